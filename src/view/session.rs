//! One page that is open: its own view, one frame on the way at a time, and what it asks for.

use super::document::Edit;
use super::frame::{encode_jpeg, encode_png, message};
use super::live::{Command, Reply};
use super::look::{Look, draw};
use super::picture::{Picture, Region};
use super::server::Shared;
use crate::color::chromaticity::{correlated_color_temperature, dominant_wavelength};
use crate::color::cie::xy;
use axum::extract::ws::{Message, WebSocket};
use serde_json::{Value, json};
use std::future::pending;
use std::sync::atomic::Ordering::SeqCst;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::task::JoinHandle;

/// States are told no more often.
const STATUS: Duration = Duration::from_millis(150);

/// A picture that is being made into a file for the page.
type Drawing = JoinHandle<Result<Vec<u8>, String>>;

/// What a page has asked to see, and where frames of it are.
struct Page {
    look: Look,
    /// Of each picture: whether it is shown, whether a newer one is there, whether one is on its way.
    shown: [bool; 2],
    stale: [bool; 2],
    in_flight: [bool; 2],
    /// The one being drawn.
    drawing: Option<(usize, Drawing)>,
}

/// Serves a page until it is closed.
pub async fn session(mut socket: WebSocket, shared: Shared) {
    let published = shared.published.clone();
    let (mut documents, mut states) = (published.document.subscribe(), published.status.subscribe());
    let [mut first, mut second] = [0, 1].map(|i| published.pictures[i].subscribe());
    let mut denoised = published.denoised.subscribe();
    documents.mark_changed();
    states.mark_changed();
    if let Some(live) = &shared.live {
        live.send(Command::Show);
    }
    let (replies, mut replied) = unbounded_channel::<Value>();
    let mut page = Page { look: Look::default(), shown: [true, false], stale: [true; 2], in_flight: [false; 2], drawing: None };
    let mut told = Instant::now() - STATUS;
    loop {
        page.draw(&shared);
        let drawing = async {
            match &mut page.drawing {
                Some((source, drawing)) => (*source, drawing.await),
                None => pending().await,
            }
        };
        let out = tokio::select! {
            Ok(()) = documents.changed() => {
                Message::text(json!({"type": "document", "document": **documents.borrow_and_update()}).to_string())
            }
            Ok(()) = async { tokio::time::sleep_until((told + STATUS).into()).await; states.changed().await } => {
                told = Instant::now();
                Message::text(json!({"type": "status", "status": **states.borrow_and_update()}).to_string())
            }
            Ok(()) = first.changed() => { page.renew_first(&shared); continue; }
            Ok(()) = denoised.changed() => { if page.look.denoises() { page.renew(0); } continue; }
            Ok(()) = second.changed() => { page.renew(1); continue; }
            Some(reply) = replied.recv() => Message::text(reply.to_string()),
            (source, drawn) = drawing => {
                page.drawing = None;
                match drawn {
                    Ok(Ok(frame)) => { page.in_flight[source] = true; Message::binary(frame) }
                    Ok(Err(text)) => Message::text(json!({"type": "unseen", "source": source, "text": text}).to_string()),
                    Err(_) => return,
                }
            }
            message = socket.recv() => match message {
                Some(Ok(Message::Text(text))) => {
                    match serde_json::from_str(&text) {
                        Ok(request) => page.take(&request, &shared, &replies),
                        // What no page of ours has written.
                        Err(_) => return,
                    }
                    continue;
                }
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
                _ => return,
            },
        };
        if socket.send(out).await.is_err() {
            return;
        }
    }
}

impl Page {
    /// A newer picture is there. What compares two is of both.
    fn renew(&mut self, source: usize) {
        self.stale[source] = true;
        if self.look.is_of_two() || source == 0 {
            self.stale = [true; 2];
        }
    }

    /// A newer first picture is there. One without noise is seen until the next one is.
    fn renew_first(&mut self, shared: &Shared) {
        self.want(shared);
        let seen = shared.published.seen(0, self.look.denoises());
        if !seen.is_some_and(|seen| self.look.denoises() && seen.denoised.get().is_some()) {
            self.renew(0);
        }
    }

    /// Asks for what the look takes beside the picture.
    fn want(&self, shared: &Shared) {
        let (Some(live), Some(picture)) = (&shared.live, shared.published.seen(0, false)) else { return };
        if self.look.needs_aovs() && picture.aovs.is_none() {
            live.send(Command::Aovs);
        }
        if self.look.denoises() {
            shared.denoiser.want(&picture);
        }
    }

    /// Begins to draw what is to be seen anew, unless one is on its way.
    fn draw(&mut self, shared: &Shared) {
        let next = (0..2).find(|&i| self.shown[i] && self.stale[i] && !self.in_flight[i]);
        let (Some(source), None) = (next, &self.drawing) else { return };
        let pictures = [0, 1].map(|i| shared.published.seen(i, self.look.denoises()));
        let Some(picture) = pictures[source].clone() else { return };
        self.stale[source] = false;
        let (look, published) = (self.look.clone(), shared.published.clone());
        let other = pictures[1 - source].clone().filter(|_| source == 1 || look.is_of_two());
        let drawing = tokio::task::spawn_blocking(move || {
            let begun = Instant::now();
            let frame = frame(&look, source, &picture, other.as_deref());
            published.spent.fetch_add(begun.elapsed().as_nanos() as u64, SeqCst);
            frame
        });
        self.drawing = Some((source, drawing));
    }

    fn take(&mut self, request: &Value, shared: &Shared, replies: &UnboundedSender<Value>) {
        let kind = request["type"].as_str().unwrap_or_default();
        match kind {
            "ack" => {
                if let Some(source) = source_of(request) {
                    self.in_flight[source] = false;
                }
            }
            "look" => {
                self.look = Look::of_json(&request["look"]);
                let both = request["both"].as_bool().unwrap_or(false);
                let source = source_of(request).unwrap_or(0);
                self.shown = [0, 1].map(|i| both || i == source);
                self.stale = [true; 2];
                self.want(shared);
            }
            "spectrum" => {
                // A mean over a large film takes its time.
                let (request, shared, replies) = (request.clone(), shared.clone(), replies.clone());
                tokio::task::spawn_blocking(move || {
                    // The page may have gone.
                    let _ = replies.send(spectrum(&request, &shared));
                });
            }
            _ => {
                if let (Some(live), Some(command)) = (&shared.live, command(kind, request, replies)) {
                    live.send(command);
                }
            }
        }
    }
}

fn source_of(request: &Value) -> Option<usize> {
    request["source"].as_u64().filter(|source| *source < 2).map(|source| source as usize)
}

/// What the engine is asked for.
fn command(kind: &str, request: &Value, replies: &UnboundedSender<Value>) -> Option<Command> {
    let is_final = request["final"].as_bool().unwrap_or(true);
    let reply = |kind: &'static str| -> Reply {
        let replies = replies.clone();
        Box::new(move |mut value| {
            if !value.is_object() {
                value = json!({"value": value});
            }
            value["type"] = json!(kind);
            // The page may have gone.
            let _ = replies.send(value);
        })
    };
    Some(match kind {
        "camera" => Command::Camera(request.get("camera").filter(|camera| !camera.is_null()).cloned(), is_final),
        "edit" => {
            let path: Vec<String> =
                request["path"].as_array()?.iter().map(|key| key.as_str().map(str::to_string)).collect::<Option<_>>()?;
            let goes_on = request["goes_on"].as_bool().unwrap_or(false);
            Command::Edit { edit: Edit { path, value: request["value"].clone() }, goes_on, is_final }
        }
        "undo" => Command::Undo(false),
        "redo" => Command::Undo(true),
        "pause" => Command::Pause(request["paused"].as_bool()?),
        "pick" => {
            let place = |key: &str| request[key].as_f64().filter(|v| (0.0..=1.0).contains(v));
            Command::Pick([place("x")?, place("y")?], reply("picked"))
        }
        "save" => Command::Save(request["name"].as_str()?.to_string(), reply("saved")),
        "json" => {
            let reply = reply("json");
            Command::Json(Box::new(move |value| reply(json!({"value": value}))))
        }
        _ => return None,
    })
}

fn frame(look: &Look, source: usize, picture: &Picture, other: Option<&Picture>) -> Result<Vec<u8>, String> {
    let drawn = draw(look, picture, other)?;
    let mut head = drawn.about.clone();
    head["source"] = json!(source);
    head["size"] = json!(drawn.size);
    head["preview"] = json!(picture.is_preview);
    let encoded = if picture.is_preview { encode_jpeg(&drawn)? } else { encode_png(&drawn, false)? };
    Ok(message(&head, &encoded))
}

/// The mean spectrum of a rectangle, from shares of the picture's width and height.
fn spectrum(request: &Value, shared: &Shared) -> Value {
    let id = &request["id"];
    let source = source_of(request).unwrap_or(0);
    let picture = shared.published.seen(source, false);
    let place: Option<[f64; 4]> = request["region"].as_array().and_then(|list| {
        let numbers: Vec<f64> = list.iter().filter_map(Value::as_f64).filter(|v| (0.0..=1.0).contains(v)).collect();
        numbers.try_into().ok()
    });
    let (Some(picture), Some([x0, y0, x1, y1])) = (picture, place) else {
        return json!({"type": "spectrum", "id": id, "source": source, "nothing": true});
    };
    let size = picture.size();
    let pixel = |share: f64, n: usize| ((share * n as f64) as usize).min(n - 1);
    let at = [pixel(x0.min(x1), size[0]), pixel(y0.min(y1), size[1])];
    let end = [pixel(x0.max(x1), size[0]), pixel(y0.max(y1), size[1])];
    let region = Region { at, size: [end[0] - at[0] + 1, end[1] - at[1] + 1] };
    let spectral = picture.spectrum(region);
    let is_light = spectral.xyz.iter().all(|v| v.is_finite() && *v >= 0.0) && spectral.xyz[1] > 0.0;
    let chromaticity = is_light.then(|| xy(spectral.xyz));
    let dominant = chromaticity.and_then(dominant_wavelength);
    let temperature = chromaticity.and_then(correlated_color_temperature);
    let [quantity, unit, photometric_unit] = picture.quantity();
    json!({
        "type": "spectrum",
        "id": id,
        "source": source,
        "pixel": region.at,
        "pixels": region.size,
        "preview": picture.is_preview,
        "quantity": quantity,
        "unit": unit,
        "photometric_unit": photometric_unit,
        "edges": picture.edges_nm(),
        "nm": picture.centres_nm(),
        "values": spectral.values,
        "errors": spectral.errors,
        "xyz": spectral.xyz,
        "xy": chromaticity,
        "rgb": crate::color::convert::linear_srgb_of_xyz(spectral.xyz),
        "dominant": dominant.map(|d| json!({"nm": d.nm, "complementary": d.complementary, "purity": d.purity})),
        "temperature": temperature.map(|(kelvin, duv)| json!({"kelvin": kelvin, "duv": duv})),
    })
}
