//! The thread that accepts a bounded number of connections.

use std::net::TcpListener;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpStream;
use tokio::runtime::{self, Runtime};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use super::access::Access;
use super::address::WebAddress;
use super::error::WebError;
use super::frames::Frames;
use super::routes::{self, Shared};

/// Largest number of connections that have no socket yet: a choice. More of them wait.
const MOST_CONNECTIONS: usize = 64;

/// Longest time of a connection before its request is complete: a choice. A connection that sends nothing keeps no place.
const HEAD: Duration = Duration::from_secs(5);

/// Largest head of a request, bytes: a choice above those of browsers, and the least that the library takes is 8192.
const LARGEST_HEAD: usize = 16_384;

/// Pause after an accept that failed, for example because the process has too many open files: a choice.
const AFTER_FAILURE: Duration = Duration::from_millis(100);

/// Longest time to close the sockets at the end: a choice.
const CLOSING: Duration = Duration::from_millis(500);

/// Server of the page; it ends when this value is dropped.
pub(crate) struct Server {
    url: String,
    frames: Option<watch::Sender<Frames>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Starts a server at the address.
    ///
    /// # Errors
    /// The address cannot be used, the thread cannot be started, or there are no random numbers.
    pub(crate) fn start(address: WebAddress) -> Result<Self, WebError> {
        let bind = |cause| WebError::Bind {
            address: address.socket(),
            cause,
        };
        let listener = TcpListener::bind(address.socket()).map_err(bind)?;
        let bound = listener.local_addr().map_err(bind)?;
        listener.set_nonblocking(true)?;
        let access = Access::to(bound.ip())?;
        let url = access.url(bound);
        let (frames, newest) = watch::channel(Frames::default());
        let runtime = runtime::Builder::new_current_thread().enable_all().build()?;
        let shared = Shared::new(access, newest);
        let thread = std::thread::Builder::new()
            .name("page".into())
            .spawn(move || run(&runtime, listener, shared))?;
        Ok(Self {
            url,
            frames: Some(frames),
            thread: Some(thread),
        })
    }

    /// Address of the page for a browser.
    pub(crate) fn url(&self) -> &str {
        &self.url
    }

    /// Changes the newest state; returns at once.
    pub(super) fn publish(&self, change: impl FnOnce(&mut Frames)) {
        if let Some(frames) = &self.frames {
            frames.send_modify(change);
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Without a sender all sockets and the thread end.
        drop(self.frames.take());
        if let Some(thread) = self.thread.take() {
            // The panic hook has already reported a panic of the thread.
            let _ = thread.join();
        }
    }
}

fn run(runtime: &Runtime, listener: TcpListener, shared: Shared) {
    runtime.block_on(async {
        match tokio::net::TcpListener::from_std(listener) {
            Ok(listener) => accept(&listener, shared).await,
            Err(error) => tracing::error!("the page cannot be served: {error}"),
        }
    });
}

/// Accepts connections until the state has no sender, then waits until the sockets are closed.
async fn accept(listener: &tokio::net::TcpListener, shared: Shared) {
    let over = ended(shared.newest());
    tokio::pin!(over);
    let (router, places) = (
        routes::router(shared.clone()),
        Arc::new(Semaphore::new(MOST_CONNECTIONS)),
    );
    loop {
        let next = async {
            // The semaphore is never closed.
            let place = places.clone().acquire_owned().await.ok();
            (listener.accept().await, place)
        };
        let (accepted, place) = tokio::select! {
            next = next => next,
            () = &mut over => break,
        };
        match (accepted, place) {
            (Ok((stream, _)), Some(place)) => {
                let service = TowerToHyperService::new(router.clone());
                tokio::spawn(connection(stream, service, place));
            }
            (Err(error), _) => {
                tracing::debug!("a connection to the page failed: {error}");
                tokio::time::sleep(AFTER_FAILURE).await;
            }
            (_, None) => break,
        }
    }
    // A browser that takes no close does not hold the end up.
    let _ = tokio::time::timeout(CLOSING, shared.closed()).await;
}

/// Returns when the state has no sender any more.
async fn ended(mut frames: watch::Receiver<Frames>) {
    while frames.changed().await.is_ok() {}
}

/// Answers one request, or hands its connection over to a socket.
async fn connection(
    stream: TcpStream,
    service: TowerToHyperService<axum::Router>,
    place: OwnedSemaphorePermit,
) {
    // Without this option small texts wait for the confirmation of those before them.
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!("small texts of the page may be late: {error}");
    }
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD)
        .max_buf_size(LARGEST_HEAD)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    if let Err(error) = served.await {
        tracing::debug!("a connection to the page failed: {error}");
    }
    drop(place);
}
