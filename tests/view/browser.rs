//! The page in a real browser: Debian's `chromium` and `chromium-driver`. Where there is none, this is not run, and `tools/test` says so.

use super::Folder;
use fantoccini::wd::Capabilities;
use fantoccini::{Client, ClientBuilder, Locator};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
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
        {"beam": {"origin": [-1, 0.05, 0], "direction": [1, 0, 0], "radius": 0.03, "irradiance": {"spectrum": {"blackbody": 6500}, "illuminance_lx": 20000}}}
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

/// A page under test.
struct Page {
    client: Client,
    shots: PathBuf,
}

impl Page {
    async fn run(&self, script: &str) -> Value {
        self.client.execute(script, vec![]).await.unwrap_or_else(|e| panic!("{script}: {e}"))
    }

    /// Waits until an expression is true; the time that took, s.
    async fn until(&self, expression: &str) -> f64 {
        let begun = Instant::now();
        while self.run(&format!("return Boolean({expression})")).await != json!(true) {
            if begun.elapsed() > Duration::from_secs(40) {
                self.shoot("failed").await;
                panic!(
                    "not within 40 s: {expression}; {}",
                    self.run("return JSON.stringify(document.body.dataset) + document.getElementById('toast').textContent").await
                );
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        begun.elapsed().as_secs_f64()
    }

    async fn shoot(&self, name: &str) {
        let png = self.client.screenshot().await.expect("a screenshot");
        std::fs::create_dir_all(&self.shots).expect("a folder");
        std::fs::write(self.shots.join(format!("{name}.png")), png).expect("a file");
    }

    async fn click(&self, css: &str) {
        let element = self.client.find(Locator::Css(css)).await.unwrap_or_else(|e| panic!("{css}: {e}"));
        element.click().await.unwrap_or_else(|e| panic!("{css}: {e}"));
    }

    async fn keys(&self, css: &str, keys: &str) {
        self.client.find(Locator::Css(css)).await.expect(css).send_keys(keys).await.expect(keys);
    }

    /// Where the light on the screen lies, as a share of the picture's height.
    async fn spot(&self) -> f64 {
        let script = "const c = document.getElementById('picture-0'), [w, h] = [c.width, c.height], d = c.getContext('2d').getImageData(0, 0, w, h).data;
            let sum = 0, at = 0;
            for (let y = 0; y < h; y++) for (let x = Math.floor(w * 0.3); x < w * 0.7; x++) {
              const v = Math.max(0, d[4 * (y * w + x) + 1] - 60) ** 2; sum += v; at += v * (y + 0.5) / h;
            }
            return at / sum";
        self.run(script).await.as_f64().expect("a place")
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
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(session());
}

async fn session() {
    let folder = Folder::new("browser");
    let scene = folder.file("prism.json", SCENE);
    let (_driver, line) = start(Command::new("chromedriver").args(["--port=0"]), "successfully on port");
    let port = line.rsplit("on port ").next().expect("a port").trim_end_matches('.').to_string();
    let profile = folder.0.join("profile");
    let arguments = [
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--window-size=1280,860",
        &format!("--user-data-dir={}", profile.display()),
    ];
    let mut capabilities = Capabilities::new();
    capabilities.insert("goog:chromeOptions".into(), json!({"args": arguments}));
    let client = ClientBuilder::new(HttpConnector::new())
        .capabilities(capabilities)
        .connect(&format!("http://127.0.0.1:{port}"))
        .await
        .expect("a browser");
    let shots = Path::new(env!("CARGO_TARGET_TMPDIR")).join("view");
    let page = Page { client, shots };

    let (abbe, url) = view(&["prism.json", "--spp", "64"], &folder.0);
    let begun = Instant::now();
    page.client.goto(&url).await.expect("the page");
    assert!(!page.client.current_url().await.expect("an address").as_str().contains("token"), "it does not stay in the history");
    page.until("document.getElementById('phase').textContent").await;
    let answered = begun.elapsed().as_secs_f64();
    page.until("Number(document.getElementById('picture-0').dataset.frames) > 0").await;
    let seen = begun.elapsed().as_secs_f64();
    page.until(DONE).await;
    eprintln!("progress after {answered:.2} s, a picture after {seen:.2} s, done after {:.2} s", begun.elapsed().as_secs_f64());
    page.shoot("scene").await;

    // The sky beside the screen is a blackbody of 5000 K: x 0.3451, y 0.3516.
    page.run("const c = document.getElementById('picture-0'), b = c.getBoundingClientRect(); c.setPointerCapture = () => {};
        for (const type of ['pointerdown', 'pointerup']) c.dispatchEvent(new PointerEvent(type, {bubbles: true, pointerId: 7, button: 0, clientX: b.left + 4, clientY: b.top + 4}))").await;
    page.until("document.getElementById('probe-place').textContent.startsWith('Pinned')").await;
    page.until("document.querySelectorAll('#plot .curve').length === 1").await;
    let numbers = page.run("return document.getElementById('numbers').textContent").await;
    let numbers = numbers.as_str().expect("text");
    let place = numbers.split("x y").nth(1).expect(numbers);
    let xy: Vec<f64> = place[..13].split(' ').map(|n| n.parse().expect(place)).collect();
    assert!((xy[0] - 0.3451).abs() < 0.003 && (xy[1] - 0.3516).abs() < 0.003, "{xy:?}");
    assert!(numbers.contains("CCT"), "{numbers}");

    // Another glass: the spot hangs lower by the difference of the indices.
    let crown = page.spot().await;
    page.click("#material-glass-glass").await;
    page.until("document.querySelectorAll('#glass-list li').length > 100").await;
    page.keys("#glass-search", "N-SF11").await;
    page.until("document.getElementById('glass-count').textContent.split(' ')[0] < 20").await;
    page.shoot("glasses").await;
    page.run("[...document.querySelectorAll('#glass-list li')].find((li) => li.dataset.name === 'N-SF11').click()").await;
    page.until("document.getElementById('glass-about').textContent.startsWith('N-SF11')").await;
    page.click("#glass-use").await;
    page.until("document.getElementById('material-glass-glass').textContent.includes('N-SF11')").await;
    page.until(DONE).await;
    let flint = page.spot().await;
    // 20 degrees, less 1 in index: (n - 1) 20 degrees after 1 m, of 0.8 m. 0.517 and 0.785.
    let lower = (20f64.to_radians() * 0.785).tan() - (20f64.to_radians() * 0.517).tan();
    assert!(((flint - crown) * 0.8 / lower - 1.0).abs() < 0.25, "{crown} {flint}, {lower}");
    page.shoot("flint").await;

    // Dragged, it follows.
    let dragged = page.client.execute_async(DRAG, vec![]).await.expect("a drag");
    eprintln!("while the camera is dragged: {} frames a second", dragged[0]);
    assert_eq!(dragged[1], "true", "previews are shown meanwhile");
    page.until(DONE).await;
    page.shoot("turned").await;

    // Saved beside the scene's file, and it is what is seen.
    page.click("#save").await;
    page.click("#save-scene").await;
    page.until("document.getElementById('save-result').textContent.startsWith('Saved')").await;
    let saved = std::fs::read_to_string(folder.0.join("prism-edited.json")).expect("a file");
    assert!(saved.contains("N-SF11"));
    page.run("document.getElementById('save-dialog').close()").await;

    // The file changes: what it says now is seen, from where the camera was turned to.
    std::fs::write(&scene, SCENE.replace("thin prism", "another name")).expect("a file");
    page.until("document.getElementById('name').textContent === 'another name'").await;
    page.until(DONE).await;

    // Every control has a name, in both lights.
    let unnamed = page.run("return [...document.querySelectorAll('button, select, input, a')].filter((e) => !(e.textContent.trim() || e.ariaLabel || e.labels?.length)).map((e) => e.outerHTML).join()").await;
    assert_eq!(unnamed, "");
    page.click("#theme").await;
    page.shoot("other-light").await;
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
    page.client.goto(&url).await.expect("the page");
    page.until("Number(document.getElementById('picture-0').dataset.frames) > 0").await;
    page.click("#sources [data-source=both]").await;
    page.until("Number(document.getElementById('picture-1').dataset.frames) > 0").await;
    page.run("const c = document.getElementById('picture-0'), b = c.getBoundingClientRect(); c.dispatchEvent(new PointerEvent('pointermove', {bubbles: true, clientX: b.left + b.width / 2, clientY: b.top + b.height / 2}))").await;
    page.until("document.querySelectorAll('#plot .curve').length === 2").await;
    page.shoot("files").await;
    page.click("#sources [data-source='0']").await;
    page.run("const view = document.getElementById('view'); view.value = 'difference'; view.dispatchEvent(new Event('change'))")
        .await;
    page.until("document.getElementById('legend-unit').textContent.startsWith('relative difference')").await;
    page.shoot("difference").await;
    page.client.clone().close().await.expect("closed");
}
