//! The server: the page's files, what it downloads, and a socket for each page that is open.

use super::access::{Access, guard};
use super::catalogue;
use super::denoiser::Denoiser;
use super::frame::encode_png;
use super::live::{Live, Published};
use super::look::{Look, draw};
use super::picture::{Content, Picture};
use super::session::session;
use crate::develop::picture::{AUTO_SHARE, auto_exposure};
use crate::output::exr::Aovs;
use crate::output::write_exr;
use crate::spectrum::library::Observer;
use axum::Router;
use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, RawQuery, State};
use axum::http::{HeaderValue, Response, StatusCode, header};
use axum::routing::{any, get};
use include_dir::{Dir, include_dir};
use percent_encoding::percent_decode_str;
use serde_json::Value;
use std::sync::Arc;

static PAGE: Dir = include_dir!("$CARGO_MANIFEST_DIR/src/view/page");

/// Bytes of a message from a page, at most.
pub const MOST_BYTES: usize = 64 << 10;

/// What all pages share.
#[derive(Clone)]
pub struct Shared {
    /// What there is to see.
    pub published: Arc<Published>,
    /// What renders; nothing where files are looked at.
    pub live: Option<Live>,
    /// What takes noise off it.
    pub denoiser: Denoiser,
}

/// The routes, behind the guard.
pub fn router(shared: Shared, access: Access) -> Router {
    Router::new()
        .route("/", get(|| async { page("index.html") }))
        .route("/page/{file}", get(|Path(file): Path<String>| async move { page(&file) }))
        .route("/data/glasses.json", get(|| data(|| catalogue::glasses().to_string())))
        .route("/data/glass.json", get(|RawQuery(query): RawQuery| async move { glass(query.as_deref()) }))
        .route("/data/choices.json", get(|| data(|| catalogue::choices().to_string())))
        .route("/picture.png", get(picture))
        .route("/picture.exr", get(spectra))
        .route("/socket", any(socket))
        .with_state(shared)
        .layer(axum::middleware::from_fn_with_state(access, guard))
}

async fn socket(State(shared): State<Shared>, upgrade: WebSocketUpgrade) -> Response<Body> {
    upgrade.max_message_size(MOST_BYTES).max_frame_size(MOST_BYTES).on_upgrade(|socket| session(socket, shared))
}

fn answer(status: StatusCode, kind: &'static str, body: impl Into<Body>) -> Response<Body> {
    let mut response = Response::new(body.into());
    *response.status_mut() = status;
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    response
}

fn problem(status: StatusCode, text: String) -> Response<Body> {
    answer(status, "text/plain; charset=utf-8", text)
}

/// What takes a while to be put together.
async fn data(make: fn() -> String) -> Response<Body> {
    match tokio::task::spawn_blocking(make).await {
        Ok(text) => json(text),
        Err(_) => defect(),
    }
}

fn defect() -> Response<Body> {
    problem(StatusCode::INTERNAL_SERVER_ERROR, "This is a defect of Abbe: please report it.".into())
}

fn json(text: String) -> Response<Body> {
    answer(StatusCode::OK, "application/json", text)
}

fn page(file: &str) -> Response<Body> {
    let kind = match file.rsplit_once('.').map(|(_, ending)| ending) {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("svg") => "image/svg+xml",
        _ => "application/octet-stream",
    };
    match PAGE.get_file(file) {
        Some(found) => answer(StatusCode::OK, kind, found.contents()),
        None => problem(StatusCode::NOT_FOUND, "There is no such page.".into()),
    }
}

/// The value of a key of a query.
fn queried(query: Option<&str>, key: &str) -> Option<String> {
    let value = query?.split('&').find_map(|pair| pair.strip_prefix(key)?.strip_prefix('='))?;
    percent_decode_str(&value.replace('+', " ")).decode_utf8().ok().map(|text| text.into_owned())
}

fn glass(query: Option<&str>) -> Response<Body> {
    match queried(query, "name").and_then(|name| catalogue::glass(&name)) {
        Some(found) => json(found.to_string()),
        None => problem(StatusCode::NOT_FOUND, "There is no such glass.".into()),
    }
}

/// As a page sees it, to keep.
async fn picture(State(shared): State<Shared>, RawQuery(query): RawQuery) -> Response<Body> {
    let value = |key| queried(query.as_deref(), key);
    let look =
        value("look").and_then(|text| serde_json::from_str(&text).ok()).map_or_else(Look::default, |v: Value| Look::of_json(&v));
    let source = usize::from(value("source").as_deref() == Some("1"));
    let drawn = tokio::task::spawn_blocking(move || {
        let shown = [0, 1].map(|i| shared.published.seen(i, look.denoises()));
        let picture = shown[source].as_deref().ok_or("there is no picture yet")?;
        let other = shown[1 - source].as_deref();
        encode_png(&draw(&look, picture, other.filter(|_| source == 1 || look.is_of_two()))?, true)
    });
    match drawn.await {
        Ok(Ok(png)) => answer(StatusCode::OK, "image/png", png),
        Ok(Err(text)) => problem(StatusCode::NOT_FOUND, text),
        Err(_) => defect(),
    }
}

/// The film as a spectral EXR.
async fn spectra(State(shared): State<Shared>) -> Response<Body> {
    let written = tokio::task::spawn_blocking(move || {
        let picture = shared.published.seen(0, false).filter(|p| !p.is_preview).ok_or("no batch is done yet")?;
        let Content::Film(film) = &picture.content else { return Err("the file is a spectral EXR already".to_string()) };
        exr(film, &picture).map_err(|e| e.to_string())
    });
    match written.await {
        Ok(Ok(exr)) => answer(StatusCode::OK, "image/x-exr", exr),
        Ok(Err(text)) => problem(StatusCode::NOT_FOUND, text),
        Err(_) => defect(),
    }
}

/// By way of a file among the temporary ones, since EXRs are written to files.
fn exr(film: &crate::film::Film, picture: &Picture) -> crate::Result<Vec<u8>> {
    let mut name = [0u8; 12];
    getrandom::fill(&mut name).map_err(|e| crate::Error::usage(e, "try again"))?;
    let name: String = name.iter().map(|b| format!("{b:02x}")).collect();
    let path = std::env::temp_dir().join(format!("abbe-view-{name}.exr"));
    let mut origin = picture.provenance.clone();
    origin.exposure = origin.exposure.or_else(|| Some(auto_exposure(&film.xyz_image(), Observer::Cie1931, AUTO_SHARE)));
    let aovs = picture.aovs.as_deref();
    let written = write_exr(
        &path,
        film,
        &origin,
        Aovs { errors: film.batches() > 1, depth: aovs, normal: aovs, albedo: aovs, ..Aovs::default() },
    );
    let read = written.and_then(|()| std::fs::read(&path).map_err(|e| crate::Error::file(&path, e, "try again")));
    // It is in nobody's way if it cannot be removed.
    let _ = std::fs::remove_file(&path);
    read
}
