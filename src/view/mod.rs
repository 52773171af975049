//! `abbe view`: a page in the browser that shows a render while it is made, or spectral files. This folder's README.md is the guide, and draws the path of
//! the data.

pub mod access;
mod catalogue;
pub mod denoiser;
pub mod document;
pub mod engine;
mod files;
mod frame;
pub mod live;
pub mod look;
pub mod pick;
pub mod picture;
mod server;
mod session;
mod summary;

pub use files::Files;

use crate::error::{Error, Result};
use access::Access;
use denoiser::Denoiser;
use live::{Live, Published};
use server::Shared;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use tokio::sync::oneshot;

/// A server that is listening.
pub struct Server {
    /// Where it is reached.
    pub address: SocketAddr,
    /// What lets a page in.
    pub token: String,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Server {
    /// Serves what is `published` at this address; port 0 takes any that is free. `live` takes what pages ask for, where a scene is rendered.
    ///
    /// # Errors
    /// [`Error::Usage`] where the address is none, or taken.
    pub fn start(host: &str, port: u16, published: Arc<Published>, live: Option<Live>) -> Result<Self> {
        let taken =
            |e: std::io::Error| Error::usage(format!("cannot listen at {host}:{port}: {e}"), "choose another --port or --host");
        let listener = TcpListener::bind((host.trim_matches(['[', ']']), port)).map_err(taken)?;
        listener.set_nonblocking(true).map_err(taken)?;
        let address = listener.local_addr().map_err(taken)?;
        let access = Access::new(host, address.port()).map_err(|problem| Error::usage(problem, "report this"))?;
        let token = access.token().to_string();
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().max_blocking_threads(4).build().map_err(taken)?;
        let denoiser = Denoiser::start(&runtime, published.clone());
        let router = server::router(Shared { published, live, denoiser }, access);
        let (stop, stopped) = oneshot::channel();
        let serve = move || {
            runtime.block_on(async {
                let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
                tokio::select! {
                    _ = async { axum::serve(listener, router).await } => {}
                    _ = stopped => {}
                }
            });
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("server".into()).spawn(serve).map_err(taken)?;
        Ok(Server { address, token, stop: Some(stop), thread: Some(thread) })
    }

    /// What to open.
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.token)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // It has nothing to tell.
            let _ = thread.join();
        }
    }
}
