//! The page and the socket, with their checks.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Request, State, WebSocketUpgrade};
use axum::http::header::{
    CACHE_CONTROL, CONNECTION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, HeaderName, HeaderValue, ORIGIN,
    REFERRER_POLICY, WWW_AUTHENTICATE, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{Method, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use tokio::sync::{Semaphore, watch};

use super::access::{Access, Refusal, random_text};
use super::frames::Frames;
use super::socket;

/// Largest number of open pages: a choice, far above the people around a machine.
pub(super) const MOST_PAGES: usize = 128;

/// Largest message of a browser, bytes: a choice. The page sends none.
const LARGEST_MESSAGE: usize = 1024;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPTS: [&str; 2] = [include_str!("charts.js"), include_str!("page.js")];

/// All that a request needs.
#[derive(Clone)]
pub(super) struct Shared {
    access: Arc<Access>,
    frames: watch::Receiver<Frames>,
    pages: Arc<Semaphore>,
}

impl Shared {
    /// The newest `frames` for all who have `access`.
    pub(super) fn new(access: Access, frames: watch::Receiver<Frames>) -> Self {
        Self {
            access: Arc::new(access),
            frames,
            pages: Arc::new(Semaphore::new(MOST_PAGES)),
        }
    }

    /// The newest state.
    pub(super) fn newest(&self) -> watch::Receiver<Frames> {
        self.frames.clone()
    }

    /// Returns when no socket is open.
    pub(super) async fn closed(&self) {
        // The semaphore is never closed.
        let _ = self.pages.acquire_many(MOST_PAGES as u32).await;
    }
}

/// Answers of the server.
pub(super) fn router(shared: Shared) -> Router {
    Router::new()
        .route("/", get(page))
        .route("/live", get(live))
        .fallback(no_such_page)
        .method_not_allowed_fallback(no_such_page)
        .layer(middleware::from_fn_with_state(shared.clone(), admit))
        .with_state(shared)
}

/// Answers only requests with access, and forbids each answer to be kept or to be read as something else.
async fn admit(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    let mut response = match check(&shared.access, &request) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refused(refusal),
    };
    let is_socket = response.status() == StatusCode::SWITCHING_PROTOCOLS;
    let heads = response.headers_mut();
    if !is_socket {
        // A browser that keeps its connection keeps a place.
        heads.insert(CONNECTION, HeaderValue::from_static("close"));
    }
    for (name, value) in [
        (CACHE_CONTROL, "no-store"),
        (REFERRER_POLICY, "no-referrer"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
        (
            HeaderName::from_static("cross-origin-opener-policy"),
            "same-origin",
        ),
    ] {
        heads.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn check(access: &Access, request: &Request) -> Result<(), Refusal> {
    // A head that is no text is no right one.
    let head = |name: HeaderName| {
        let value = request.headers().get(name)?;
        Some(value.to_str().unwrap_or_default())
    };
    access.check(head(HOST), head(ORIGIN), request.uri().query())
}

fn refused(refusal: Refusal) -> Response {
    match refusal {
        Refusal::Host => message(
            StatusCode::FORBIDDEN,
            "This address is not one of this monitor. Open the address that quietcut monitor has printed.",
        ),
        Refusal::Origin => message(
            StatusCode::FORBIDDEN,
            "A page of another site may not read this monitor. Open the address that quietcut monitor has printed.",
        ),
        Refusal::Token => {
            let mut response = message(
                StatusCode::UNAUTHORIZED,
                "The address has no token, or a wrong one. Open the whole address that quietcut monitor has printed, \
                 with ?token= and what follows.",
            );
            let heads = response.headers_mut();
            heads.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            response
        }
    }
}

/// A page that is only a sentence.
fn message(status: StatusCode, sentence: &str) -> Response {
    let page = format!(
        "<!DOCTYPE html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <meta name=\"color-scheme\" content=\"light dark\"><title>quietcut</title><h1>quietcut</h1><p>{sentence}</p></html>\n"
    );
    let policy = [(CONTENT_SECURITY_POLICY, "default-src 'none'")];
    (status, policy, Html(page)).into_response()
}

async fn no_such_page(method: Method) -> Response {
    if method == Method::GET || method == Method::HEAD {
        message(
            StatusCode::NOT_FOUND,
            "There is no such page here: the monitor is at /.",
        )
    } else {
        message(
            StatusCode::METHOD_NOT_ALLOWED,
            "The monitor can only be read: GET /.",
        )
    }
}

/// The page. Style and scripts are in it, and no others may run: each page has a number of its own for them.
async fn page() -> Response {
    let Ok(nonce) = random_text() else {
        return message(
            StatusCode::INTERNAL_SERVER_ERROR,
            "The operating system gives no random numbers.",
        );
    };
    let page = PAGE
        .replace("{nonce}", &nonce)
        .replace("{style}", STYLE)
        .replace("{script}", &SCRIPTS.concat());
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let heads = [
        (CONTENT_TYPE, "text/html; charset=utf-8".to_owned()),
        (CONTENT_SECURITY_POLICY, policy),
    ];
    (heads, page).into_response()
}

/// The socket.
async fn live(State(shared): State<Shared>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(permit) = shared.pages.clone().try_acquire_owned() else {
        return message(
            StatusCode::SERVICE_UNAVAILABLE,
            "Too many pages of this monitor are open: close one of them.",
        );
    };
    upgrade
        .max_message_size(LARGEST_MESSAGE)
        .max_frame_size(LARGEST_MESSAGE)
        .on_upgrade(async move |socket| {
            socket::serve(socket, shared.frames).await;
            drop(permit);
        })
}
