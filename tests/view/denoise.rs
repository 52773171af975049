//! Denoised pictures: the page that wants them sees what is nearer to the truth, and nothing else changes.

use super::access::cookie;
use super::engine::{Running, SPP, bits, film};
use super::http::{Socket, get};
use super::{Folder, SCENE};
use abbe::color::convert::srgb_decode;
use abbe::film::Film;
use abbe::integrator::GpuIntegrator;
use abbe::output::SpectralImage;
use abbe::render::{Rendering, Stop};
use abbe::scene::LoadOptions;
use abbe::view::Server;
use abbe::view::document::Document;
use abbe::view::live::Command;
use abbe::view::look::{Look, draw};
use abbe::view::picture::{Content, Picture};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Samples of what is taken for the truth, for each of the picture.
const MORE: u32 = 24;

/// sRGB of a PNG.
fn pixels(png: &[u8]) -> Vec<u8> {
    image::load_from_memory(png).expect("a picture").to_rgb8().into_raw()
}

/// relMSE of the luminance that a screen shows.
fn error(shown: &[u8], truth: &[u8]) -> f64 {
    let luminance = |rgb: &[u8]| {
        let [r, g, b] = [0, 1, 2].map(|i| srgb_decode(f64::from(rgb[i]) / 255.0));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let truth: Vec<f64> = truth.chunks_exact(3).map(luminance).collect();
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let squares = shown.chunks_exact(3).map(luminance).zip(&truth).map(|(v, t)| (v - t).powi(2) / (t * t + 0.01 * mean * mean));
    squares.sum::<f64>() / truth.len() as f64
}

/// Waits for a picture without noise that is as wanted.
fn denoised(running: &Running, is_wanted: impl Fn(&Arc<Picture>) -> bool) -> Arc<Picture> {
    let begun = Instant::now();
    loop {
        let seen = running.published.seen(0, true).filter(|seen| seen.denoised.get().is_some() && is_wanted(seen));
        match seen {
            Some(seen) => return seen,
            None => assert!(begun.elapsed() < Duration::from_secs(120), "it is not denoised"),
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Has a page draw by this look until it shows what it is to show.
fn receives(page: &mut Socket, mut shown: Vec<u8>, look: &Value, expected: &[u8]) -> Vec<u8> {
    for _ in 0..100 {
        if shown == expected {
            return shown;
        }
        page.send(&json!({"type": "look", "look": look}).to_string());
        shown = pixels(&page.frame(|_| true).expect("a frame").1);
    }
    panic!("it shows something else")
}

/// What `render` makes of it: with the samples of the live view, and with more.
fn rendered(path: &std::path::Path) -> [Film; 2] {
    let scene = abbe::scene::load(path, &LoadOptions::default()).expect("a scene");
    let mut rendering = Rendering::new(Film::new(&scene.film));
    let mut integrator = GpuIntegrator::new(&scene, None, 0).expect("an adapter");
    [SPP, MORE * SPP].map(|spp| {
        let stop = Stop { spp: Some(spp), ..Stop::default() };
        rendering.render(&mut integrator, &stop, &mut |_, _| ControlFlow::Continue(())).expect("a render");
        rendering.film.clone()
    })
}

#[test]
fn a_page_that_wants_it_sees_less_noise_and_all_else_stays_raw() {
    let folder = Folder::new("denoise");
    // Soft shadows: of a picture this small with glass in it, a few bright pixels are all the error.
    let changes = [
        (r#"{"dielectric": {"ior": "N-BK7"}}"#, r#"{"diffuse": {"reflectance": 0.3}}"#),
        (r#""radius": 0.2}"#, r#""radius": 0.9}"#),
        (r#""width": 48, "height": 32"#, r#""width": 96, "height": 64"#),
    ];
    let text = changes.iter().fold(SCENE.to_string(), |text, (from, to)| text.replace(from, to));
    let path = folder.file("soft.json", &text);
    let (document, scene) = Document::open(&path, LoadOptions::default()).expect("a scene");
    let running = Running::start(document, scene);
    let server = Server::start("127.0.0.1", 0, running.published.clone(), Some(running.live.clone())).expect("a server");
    let cookie = cookie(&server);
    let open = |look: &Value| {
        let mut socket = Socket::open(server.address, &[("Cookie", &cookie)]).expect("a socket");
        socket.send(&json!({"type": "look", "look": look}).to_string());
        socket
    };
    let (plain, wanted) = (json!({}), json!({"denoise": true}));
    let (mut raw_page, mut page) = (open(&plain), open(&wanted));

    // The picture that has settled, as soon as that is denoised.
    let settled = running.settled(None);
    let picture = denoised(&running, |seen| bits(film(seen)) == bits(film(&settled)));
    let bare = Picture {
        provenance: picture.provenance.clone(),
        ..Picture::new(String::new(), Content::Film(Box::new(film(&picture).clone())))
    };
    let drawn = |look: &Value, picture: &Picture| draw(&Look::of_json(look), picture, None).expect("pixels");
    let raw = drawn(&plain, &bare).rgb;
    let (head, shown) = page.frame(|head| head["denoised"] == true && head["preview"] == false).expect("a frame");
    let shown = receives(&mut page, pixels(&shown), &wanted, &drawn(&wanted, &picture).rgb);
    let exposure = head["exposure"].as_f64().expect("stops");
    let [same, truth] = rendered(&path);
    let truth = Picture::new(String::new(), Content::Film(Box::new(truth)));
    let truth = drawn(&json!({"exposure": exposure.to_string()}), &truth).rgb;
    let (with, without) = (error(&shown, &truth), error(&raw, &truth));
    assert!(with < 0.6 * without, "{with} of {without}");

    // The other page sees the film, and what is kept or measured is that.
    let (_, first) = raw_page.frame(|head| head["preview"] == false && head["denoised"] == false).expect("a frame");
    receives(&mut raw_page, pixels(&first), &plain, &raw);
    assert_eq!(bits(film(&picture)), bits(&same), "as `render` has it");
    page.send(&json!({"type": "spectrum", "id": 1, "region": [0.5, 0.9, 0.5, 0.9]}).to_string());
    let spectrum = page.message("spectrum").expect("an answer");
    let pixel = (0.9 * 64.0) as usize * 96 + 48;
    // As JSON has numbers, to the last digit but one.
    let sent =
        |key: &str| spectrum[key].as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect::<Vec<_>>();
    let is_same = |(sent, of_film): (&f64, &f64)| (sent - of_film).abs() <= 1e-14 * of_film.abs();
    assert!(sent("values").iter().zip(&same.pixel(pixel)[..8]).all(is_same) && sent("values").len() == 8, "{spectrum}");
    assert!(sent("xyz").iter().zip(&same.xyz(pixel)).all(is_same) && sent("xyz").len() == 3, "{spectrum}");
    let kept = |path: &str| get(server.address, path, &[("Cookie", &cookie)]).body;
    let exr = folder.0.join("kept.exr");
    std::fs::write(&exr, kept("/picture.exr")).expect("a file");
    let exr = SpectralImage::read(&exr).expect("an EXR");
    let values: Vec<f32> =
        (0..same.pixels()).flat_map(|p| same.pixel(p)[..8].iter().map(|v| *v as f32).collect::<Vec<_>>()).collect();
    let luminance: Vec<f32> = (0..same.pixels()).map(|p| same.xyz(p)[1] as f32).collect();
    assert!(exr.data == values && exr.other("XYZ.Y") == Some(&luminance[..]));
    assert_eq!(pixels(&kept("/picture.png")), raw);
    assert_eq!(pixels(&kept("/picture.png?look=%7B%22denoise%22:true%7D")), shown, "as seen");

    // Another camera is seen raw until that is denoised, and once nobody wants it nothing is done for it.
    let camera = |x: f64| json!({"perspective": {"eye": [x, 1.5, 4], "target": [0, 0.5, 0], "vfov_deg": 30}});
    running.live.send(Command::Camera(Some(camera(0.5)), true));
    page.frame(|head| head["denoised"] == false).expect("a preview");
    let turned = denoised(&running, |seen| seen.render != picture.render);
    page.send(&json!({"type": "look", "look": plain}).to_string());
    page.send(&json!({"type": "spectrum", "id": 2, "region": [0, 0, 0, 0]}).to_string());
    page.message("spectrum").expect("an answer to what came before");
    let turned = Some(running.settled(None)).filter(|now| now.render == turned.render).expect("the same render");
    running.live.send(Command::Camera(Some(camera(0.7)), true));
    let again = running.settled(Some(&turned));
    assert!(again.render > turned.render && again.aovs.is_none() && again.denoised.get().is_none());
    assert!(running.published.seen(0, true).is_some_and(|seen| Arc::ptr_eq(&seen, &again)));
}
