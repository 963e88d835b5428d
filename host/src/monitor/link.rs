//! The thread that receives from the device, and connects again after the cable was pulled.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use quietcut_core::protocol::{Info, Reports, Subscription};

use quietcut_core::working_point::WorkingPoint;

use super::received::Identity;
use crate::device::{Client, DeviceError, Event};

/// Longest wait for an event before the end of the program is checked: a choice.
const EVENT_TIMEOUT: Duration = Duration::from_millis(100);

/// Pause between two attempts to connect again: a choice, short against the time in which a plug is put in.
const BETWEEN_TRIES: Duration = Duration::from_millis(500);

/// Time without any event after which the device is asked whether it is still there: a choice. A device that was
/// restarted behind an adapter has forgotten that it shall send, and its port does not vanish.
const SILENCE: Duration = Duration::from_secs(3);

/// Time between two questions for the working point: a choice. Another program or a restart may change it, and chart and
/// margin follow.
const BETWEEN_STATES: Duration = Duration::from_secs(2);

/// News of the device.
pub(crate) enum News {
    /// The connection is made, for the first time or again.
    Up(Identity),
    /// The working point of the device has changed.
    Point(Option<WorkingPoint>),
    /// The device sent an event.
    Event(Box<Event>),
    /// The connection is lost and is tried again.
    Gone(DeviceError),
    /// The first connection failed, or no attempt can help: the last news.
    Failed(DeviceError),
    /// Number of messages that were lost on the serial line on the last connection; no news follow.
    Ended(u32),
}

/// Subscription of the view: all that the device can send.
const ALL: Subscription = Subscription {
    reports: Reports::All,
    spectra: true,
    strobes: true,
};

/// Receives from the device until `stop` is true or nobody receives the news; `connect` makes a new connection.
pub(crate) fn listen(
    mut connect: impl FnMut() -> Result<(Client, Info), DeviceError>,
    news: &SyncSender<News>,
    stop: &AtomicBool,
) {
    let mut was_up = false;
    while !stop.load(Ordering::Relaxed) {
        let outcome = connect().and_then(|(client, info)| session(client, &info, news, stop, &mut was_up));
        let last = match outcome {
            Ok(lost) => News::Ended(lost),
            Err(error) if was_up && may_return(&error) => {
                if news.send(News::Gone(error)).is_err() {
                    return;
                }
                pause(stop);
                continue;
            }
            Err(error) => News::Failed(error),
        };
        // Nobody receives the news after the end of the view.
        let _ = news.send(last);
        return;
    }
}

/// Waits for [`BETWEEN_TRIES`], or for `stop`.
fn pause(stop: &AtomicBool) {
    let began = Instant::now();
    while began.elapsed() < BETWEEN_TRIES && !stop.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// True if the fault can pass without a change by the user: a pulled cable, a device that restarts.
fn may_return(error: &DeviceError) -> bool {
    matches!(
        error,
        DeviceError::NoPort { .. }
            | DeviceError::Open { .. }
            | DeviceError::Unplugged { .. }
            | DeviceError::Line { .. }
            | DeviceError::NoAnswer { .. }
            | DeviceError::Frames { .. }
            | DeviceError::Refused { .. }
    )
}

/// Receives on one connection until `stop`; returns the number of messages lost on it.
fn session(
    mut client: Client,
    info: &Info,
    news: &SyncSender<News>,
    stop: &AtomicBool,
    was_up: &mut bool,
) -> Result<u32, DeviceError> {
    let (settings, status) = (client.settings()?, client.status()?);
    let identity = Identity {
        name: format!("{} {}", info.board, info.firmware),
        teeth: settings.tool.teeth,
        table: info.table.as_ref().map(|table| table.name.as_str().into()),
        working_point: status.working_point,
    };
    client.subscribe(ALL)?;
    *was_up = true;
    let mut point = identity.working_point;
    let mut is_received = news.send(News::Up(identity)).is_ok();
    let (mut last_event, mut last_state) = (Instant::now(), Instant::now());
    while is_received && !stop.load(Ordering::Relaxed) {
        if last_state.elapsed() > BETWEEN_STATES {
            last_state = Instant::now();
            let present = client.status()?.working_point;
            if present != point {
                point = present;
                is_received = news.send(News::Point(point)).is_ok();
            }
        }
        if let Some(event) = client.next_event(EVENT_TIMEOUT)? {
            last_event = Instant::now();
            is_received = news.send(News::Event(Box::new(event))).is_ok();
        } else if last_event.elapsed() > SILENCE {
            client.subscribe(ALL)?;
            last_event = Instant::now();
        }
    }
    client.subscribe(Subscription::default())?;
    Ok(client.lost_frames())
}
