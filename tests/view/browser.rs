//! The page in a real browser: Debian's `chromium` and `chromium-driver`. Where there is none, this is not run, and `tools/test` says so.

use super::Folder;
use super::http::json as request;
use base64::Engine;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// White light through a thin prism onto a screen that the camera sees: the spot hangs the lower, the greater the index. Beside the screen, the sky.
const SCENE: &str = r#"{
    "name": "thin prism",
    "film": {"width": 192, "height": 144, "range_nm": [380, 780], "bins": 20},
    "camera": {"orthographic": {"eye": [0.6, -0.2, 0], "target": [1, -0.2, 0], "height": 0.8}},
    "lights": [
        {"constant": {"radiance": {"spectrum": {"blackbody": 5000}, "luminance_cd_m2": 100}}},
        {"beam": {"origin": [-1, 0.05, 0], "direction": [1, 0, 0], "radius": 0.06, "irradiance": {"spectrum": {"blackbody": 6500}, "illuminance_lx": 20000}}}
    ],
    "materials": {"screen": {"diffuse": {"reflectance": 0.7}}, "glass": {"dielectric": {"ior": "N-BK7"}}},
    "shapes": [
        {"name": "screen", "quad": {"corner": [1, -0.55, -0.4], "edge_u": [0, 0, 0.8], "edge_v": [0, 0.7, 0]}, "material": "screen"},
        {"name": "prism", "prism": {"polygon": [[-0.0529, -0.1], [0.0529, -0.1], [0, 0.2]], "length": 0.3}, "material": "glass"}
    ]
}"#;

/// A process that does not outlive its test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a command and waits for a line of its output that has `sign`.
fn start(command: &mut Command, sign: &str) -> (Running, String) {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("a process");
    let out = BufReader::new(child.stdout.take().expect("its output"));
    let running = Running(child);
    let mut lines = out.lines().map_while(Result::ok);
    let line = lines.find(|line| line.contains(sign)).expect(sign);
    // It may have more to say, which must not stop it.
    std::thread::spawn(move || lines.for_each(drop));
    (running, line)
}

fn view(arguments: &[&str], folder: &Path) -> (Running, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_abbe"));
    command.arg("view").args(arguments).args(["--no-open"]).current_dir(folder);
    let (running, line) = start(&mut command, "http://");
    let url = line.split_whitespace().find(|word| word.starts_with("http://")).expect("an address").to_string();
    (running, url)
}

fn is_installed(name: &str) -> bool {
    std::env::var_os("PATH").is_some_and(|paths| std::env::split_paths(&paths).any(|folder| folder.join(name).is_file()))
}

/// A page under test, by the W3C's WebDriver: of its requests only a few are needed.
struct Page {
    driver: SocketAddr,
    session: String,
    shots: PathBuf,
}

impl Page {
    /// Opens a browser.
    fn open(driver: SocketAddr, profile: &Path) -> Self {
        let shots = Path::new(env!("CARGO_TARGET_TMPDIR")).join("view");
        std::fs::create_dir_all(&shots).expect("a folder");
        let profile = format!("--user-data-dir={}", profile.display());
        let arguments = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1280,860", &profile];
        let wanted = json!({"capabilities": {"alwaysMatch": {"goog:chromeOptions": {"args": arguments}}}});
        let session = request(driver, "POST", "/session", &wanted).expect("a browser");
        Page { driver, session: session["sessionId"].as_str().expect("a session").into(), shots }
    }

    fn ask(&self, method: &str, path: &str, body: &Value) -> Value {
        let path = format!("/session/{}{path}", self.session);
        request(self.driver, method, &path, body).unwrap_or_else(|e| panic!("{e}; {body}"))
    }

    fn go(&self, url: &str) {
        self.ask("POST", "/url", &json!({"url": url}));
    }

    fn run(&self, script: &str) -> Value {
        self.ask("POST", "/execute/sync", &json!({"script": script, "args": []}))
    }

    /// Waits until an expression is true.
    fn until(&self, expression: &str) {
        let begun = Instant::now();
        while self.run(&format!("return Boolean({expression})")) != json!(true) {
            if begun.elapsed() > Duration::from_secs(40) {
                self.shoot("failed");
                let state =
                    self.run("return JSON.stringify(document.body.dataset) + document.getElementById('toast').textContent");
                panic!("not within 40 s: {expression}; {state}");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until what was asked for last is rendered.
    fn settle(&self) {
        // States are told a little later than documents.
        std::thread::sleep(Duration::from_millis(500));
        self.until(DONE);
        // And pictures later than states.
        let frames = || self.run("return document.getElementById('picture-0').dataset.frames");
        let mut last = Value::Null;
        while last != frames() {
            last = frames();
            std::thread::sleep(Duration::from_millis(300));
        }
    }

    /// Keeps what is seen, to be looked at.
    fn shoot(&self, name: &str) {
        let png = self.ask("GET", "/screenshot", &Value::Null);
        let png = base64::prelude::BASE64_STANDARD.decode(png.as_str().expect("a picture")).expect("base64");
        std::fs::write(self.shots.join(format!("{name}.png")), png).expect("a file");
    }

    /// An element, as WebDriver names it.
    fn find(&self, css: &str) -> String {
        let found = self.ask("POST", "/element", &json!({"using": "css selector", "value": css}));
        found.as_object().and_then(|o| o.values().next()).and_then(Value::as_str).expect(css).to_string()
    }

    fn click(&self, css: &str) {
        self.ask("POST", &format!("/element/{}/click", self.find(css)), &json!({}));
    }

    fn keys(&self, css: &str, text: &str) {
        self.ask("POST", &format!("/element/{}/value", self.find(css)), &json!({"text": text}));
    }

    /// Has `axe-core` look for what keeps people from using the page.
    fn hold_to_axe(&self, what: &str) {
        let packed = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/axe/axe.min.js.gz")).expect("axe-core");
        let mut axe = String::new();
        flate2::read::GzDecoder::new(&packed[..]).read_to_string(&mut axe).expect("text");
        self.run(&axe);
        let script = "const done = arguments[arguments.length - 1];
            axe.run({resultTypes: ['violations']}).then((found) => done(found.violations.map((v) => `${v.id} (${v.impact}): ${v.nodes.map((n) => n.html).join()}`)))";
        let found = self.ask("POST", "/execute/async", &json!({"script": script, "args": []}));
        assert_eq!(found, json!([]), "{what}");
    }

    /// Where the light on the screen lies, as a share of the picture's height.
    fn spot(&self) -> f64 {
        let script = "const c = document.getElementById('picture-0'), [w, h] = [c.width, c.height], d = c.getContext('2d').getImageData(0, 0, w, h).data;
            let sum = 0, at = 0;
            for (let y = 0; y < h; y++) for (let x = Math.floor(w * 0.3); x < w * 0.7; x++) {
              const v = Math.max(0, d[4 * (y * w + x) + 1] - 200); sum += v; at += v * (y + 0.5) / h;
            }
            return at / sum";
        self.run(script).as_f64().expect("a place")
    }
}

const DONE: &str = "document.body.dataset.phase === 'done' && document.getElementById('picture-0').dataset.preview === 'false'";
/// Drags over the picture by pointer events, a step every 30 ms for a second, and tells how many frames came.
const DRAG: &str = "const canvas = document.getElementById('picture-0'), box = canvas.getBoundingClientRect(), done = arguments[arguments.length - 1];
    const tell = (type, x) => canvas.dispatchEvent(new PointerEvent(type, {bubbles: true, pointerId: 1, button: 0, clientX: box.left + x, clientY: box.top + box.height / 2}));
    canvas.setPointerCapture = () => {};
    const before = Number(canvas.dataset.frames); let x = box.width / 3, steps = 0;
    tell('pointerdown', x);
    const timer = setInterval(() => {
      tell('pointermove', x += 2);
      if (++steps < 50) return;
      clearInterval(timer);
      const frames = Number(canvas.dataset.frames) - before, preview = canvas.dataset.preview;
      tell('pointerup', x);
      done([frames / 1.5, preview]);
    }, 30);";

#[test]
fn the_page_does_in_a_browser_what_it_says() {
    if !(is_installed("chromium") && is_installed("chromedriver")) {
        eprintln!("not run: chromium and chromedriver are not installed");
        return;
    }
    session();
}

fn session() {
    let folder = Folder::new("browser");
    let scene = folder.file("prism.json", SCENE);
    let (_driver, line) = start(Command::new("chromedriver").args(["--port=0"]), "successfully on port");
    let port = line.rsplit("on port ").next().expect("a port").trim_end_matches('.').to_string();
    let page = Page::open(SocketAddr::from(([127, 0, 0, 1], port.parse().expect("a port"))), &folder.0.join("profile"));

    let (abbe, url) = view(&["prism.json", "--spp", "24"], &folder.0);
    let begun = Instant::now();
    page.go(&url);
    let address = page.ask("GET", "/url", &Value::Null);
    assert!(address.as_str().is_some_and(|url| !url.contains("token")), "it does not stay in the history: {address}");
    page.until("document.getElementById('phase').textContent");
    let answered = begun.elapsed().as_secs_f64();
    page.until("Number(document.getElementById('picture-0').dataset.frames) > 0");
    let seen = begun.elapsed().as_secs_f64();
    page.settle();
    eprintln!("progress after {answered:.2} s, a picture after {seen:.2} s, done after {:.2} s", begun.elapsed().as_secs_f64());
    page.shoot("scene");

    // What is seen without noise says so.
    let shown = |denoised: bool| format!("document.querySelector('.frame').dataset.denoised === '{denoised}'");
    page.until(&shown(false));
    page.click("#denoise");
    page.until(&shown(true));
    page.shoot("denoised");
    page.click("#denoise");
    page.until(&shown(false));

    // The sky beside the screen is a blackbody of 5000 K: x 0.3451, y 0.3516.
    page.run("const c = document.getElementById('picture-0'), b = c.getBoundingClientRect(); c.setPointerCapture = () => {};
        for (const type of ['pointerdown', 'pointerup']) c.dispatchEvent(new PointerEvent(type, {bubbles: true, pointerId: 7, button: 0, clientX: b.left + 4, clientY: b.top + 4}))");
    page.until("document.getElementById('probe-place').textContent.startsWith('Pinned')");
    page.until("document.querySelectorAll('#plot .curve').length === 1");
    let numbers = page.run("return document.getElementById('numbers').textContent");
    let numbers = numbers.as_str().expect("text");
    let place = numbers.split("x y").nth(1).expect(numbers);
    let xy: Vec<f64> = place[..13].split(' ').map(|n| n.parse().expect(place)).collect();
    assert!((xy[0] - 0.3451).abs() < 0.003 && (xy[1] - 0.3516).abs() < 0.003, "{xy:?}");
    assert!(numbers.contains("CCT"), "{numbers}");

    // Another glass: the spot hangs lower by the difference of the indices.
    let crown = page.spot();
    page.click("#material-glass-glass");
    page.until("document.querySelectorAll('#glass-list li').length > 100");
    page.keys("#glass-search", "N-SF11");
    page.until("document.getElementById('glass-count').textContent.split(' ')[0] < 20");
    page.shoot("glasses");
    page.run("[...document.querySelectorAll('#glass-list li')].find((li) => li.dataset.name === 'N-SF11').click()");
    page.until("document.getElementById('glass-about').textContent.startsWith('N-SF11')");
    page.click("#glass-use");
    page.until("document.getElementById('material-glass-glass').textContent.includes('N-SF11')");
    page.settle();
    let flint = page.spot();
    // 20 degrees, less 1 in index: (n - 1) 20 degrees after 1 m, of 0.8 m. 0.517 and 0.785.
    let lower = (20f64.to_radians() * 0.785).tan() - (20f64.to_radians() * 0.517).tan();
    assert!(((flint - crown) * 0.8 / lower - 1.0).abs() < 0.25, "{crown} {flint}, {lower}");
    page.shoot("flint");

    // Dragged, it follows.
    let dragged = page.ask("POST", "/execute/async", &json!({"script": DRAG, "args": []}));
    eprintln!("while the camera is dragged: {} frames a second", dragged[0]);
    assert_eq!(dragged[1], "true", "previews are shown meanwhile");
    page.settle();
    page.shoot("turned");

    // Saved beside the scene's file, and it is what is seen.
    page.click("#save");
    page.click("#save-scene");
    page.until("document.getElementById('save-result').textContent.startsWith('Saved')");
    let saved = std::fs::read_to_string(folder.0.join("prism-edited.json")).expect("a file");
    assert!(saved.contains("N-SF11"));
    page.run("document.getElementById('save-dialog').close()");

    // The file changes: what it says now is seen, from where the camera was turned to.
    std::fs::write(&scene, SCENE.replace("thin prism", "another name")).expect("a file");
    page.until("document.getElementById('name').textContent === 'another name'");
    page.settle();

    // A lens has no field of view of its own, and is moved like a pinhole that sees as much.
    let moved = "const done = arguments[arguments.length - 1]; import('/page/camera.js').then(({pan, orbit}) => {
        const place = {eye: [0, 1, 4], target: [0, 0, 0]}, moved = (camera) => orbit(pan(camera, 0.1, 0.2, 30), 0.3, 0.1);
        done([moved({lens: {...place, prescription: 'x'}}).lens, moved({perspective: {...place, vfov_deg: 30}}).perspective]);
    })";
    let moved = page.ask("POST", "/execute/async", &json!({"script": moved, "args": []}));
    assert!(moved[0]["eye"][0].is_number() && moved[0]["eye"] == moved[1]["eye"] && moved[0]["target"] == moved[1]["target"]);

    // Every control has a name, in both lights.
    page.hold_to_axe("light");
    let unnamed = page.run("return [...document.querySelectorAll('button, select, input, a')].filter((e) => !(e.textContent.trim() || e.ariaLabel || e.labels?.length)).map((e) => e.outerHTML).join()");
    assert_eq!(unnamed, "");
    page.click("#theme");
    page.shoot("other-light");
    page.hold_to_axe("dark");
    for (button, dialog) in [("#material-glass-glass", "glass"), ("#save", "save"), ("#help", "help")] {
        page.click(button);
        page.until(&format!("document.getElementById('{dialog}-dialog').open"));
        page.hold_to_axe(dialog);
        page.run(&format!("document.getElementById('{dialog}-dialog').close()"));
    }
    drop(abbe);

    // Two files.
    for seed in ["1", "2"] {
        let arguments =
            ["render", "prism-edited.json", "--size", "96x72", "--spp", "16", "--aov", "error", "--quiet", "--seed", seed, "-o"];
        let done =
            Command::new(env!("CARGO_BIN_EXE_abbe")).args(arguments).arg(format!("{seed}.exr")).current_dir(&folder.0).status();
        assert!(done.expect("a render").success());
    }
    let (_files, url) = view(&["1.exr", "2.exr"], &folder.0);
    page.go(&url);
    page.until("Number(document.getElementById('picture-0').dataset.frames) > 0");
    page.click("#sources [data-source=both]");
    page.until("Number(document.getElementById('picture-1').dataset.frames) > 0");
    page.run("const c = document.getElementById('picture-0'), b = c.getBoundingClientRect(); c.dispatchEvent(new PointerEvent('pointermove', {bubbles: true, clientX: b.left + b.width / 2, clientY: b.top + b.height / 2}))");
    page.until("document.querySelectorAll('#plot .curve').length === 2");
    page.shoot("files");
    page.hold_to_axe("files");
    page.click("#sources [data-source='0']");
    page.run("const view = document.getElementById('view'); view.value = 'difference'; view.dispatchEvent(new Event('change'))");
    page.until("document.getElementById('legend-unit').textContent.startsWith('relative difference')");
    page.shoot("difference");
    page.ask("DELETE", "", &Value::Null);
}
