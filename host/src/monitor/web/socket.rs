//! Sends the newest state to one browser, until either of them ends.

use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::frames::{Frames, TOPICS};

/// Longest time that a browser may take to receive one text: a choice. The socket of a browser that takes longer is
/// closed; the page connects again when it can.
const SEND: Duration = Duration::from_secs(10);

/// Time between two texts that say that the command still runs: a choice. The page counts its connection as lost after
/// a few of them.
const BEAT: Duration = Duration::from_secs(3);

/// Text that says that the command still runs.
const ALIVE: &str = r#"{"topic":"alive"}"#;

/// Sends each newest state to the browser. The page sends no messages: one that does is closed.
pub(super) async fn serve(mut socket: WebSocket, mut frames: watch::Receiver<Frames>) {
    let mut sent = [0; TOPICS];
    let mut beat = interval(BEAT);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let newest = frames.borrow_and_update().clone();
        for text in newest.take_newer(&mut sent) {
            if !send(&mut socket, Message::Text(text)).await {
                return;
            }
        }
        tokio::select! {
            changed = frames.changed() => {
                if changed.is_err() {
                    close(&mut socket, close_code::AWAY, "quietcut monitor has ended").await;
                    return;
                }
            }
            message = socket.recv() => match message {
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Text(_) | Message::Binary(_))) => {
                    close(&mut socket, close_code::POLICY, "quietcut monitor takes no messages").await;
                    return;
                }
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
            },
            _ = beat.tick() => {
                if !send(&mut socket, Message::Text(ALIVE.into())).await {
                    return;
                }
            }
        }
    }
}

/// Sends a message; false if the browser is gone or too slow.
async fn send(socket: &mut WebSocket, message: Message) -> bool {
    matches!(timeout(SEND, socket.send(message)).await, Ok(Ok(())))
}

async fn close(socket: &mut WebSocket, code: u16, reason: &'static str) {
    let frame = CloseFrame {
        code,
        reason: reason.into(),
    };
    send(socket, Message::Close(Some(frame))).await;
}
