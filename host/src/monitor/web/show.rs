//! The loop over news and published states.

use std::time::{Duration, Instant};

use super::server::Server;
use crate::monitor::live::{Live, LiveError, Outcome};
use crate::monitor::received::Received;

/// Time between two published states while verdict and connection stay: a choice; charts that change ten times a second
/// are smooth. A change of the verdict is published at once.
const BETWEEN_STATES: Duration = Duration::from_millis(100);

/// Shows the state on the page of `server` until `is_over`. `on_news` is called after each change of the state.
///
/// # Errors
/// The state cannot be kept up to date, or `on_news` fails.
pub(crate) fn show<E: From<LiveError>>(
    mut live: Live,
    server: &Server,
    is_over: impl Fn() -> bool,
    mut on_news: impl FnMut(&Received) -> Result<(), E>,
) -> Result<Outcome, E> {
    let mut published: Option<Instant> = None;
    let mut lines = 0;
    let mut is_stale = true;
    while !is_over() {
        let due = published.map_or(Duration::ZERO, |then| {
            BETWEEN_STATES.saturating_sub(then.elapsed())
        });
        if is_stale && due.is_zero() {
            server.publish(|frames| {
                frames.take_head(&live.received);
                frames.take_charts(&live.received);
            });
            published = Some(Instant::now());
            is_stale = false;
            continue;
        }
        let patience = if is_stale { due } else { BETWEEN_STATES };
        if !live.take(patience)? {
            continue;
        }
        is_stale = true;
        // Each change of verdict, advice or connection adds a line to the history.
        if live.received.line_count != lines {
            lines = live.received.line_count;
            server.publish(|frames| frames.take_head(&live.received));
        }
        on_news(&live.received)?;
    }
    Ok(live.end())
}
