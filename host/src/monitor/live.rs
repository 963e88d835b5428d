//! The received state, kept up to date by the thread of the device.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use quietcut_core::lobes::TableError;
use quietcut_core::protocol::Info;
use quietcut_core::working_point::WorkingPoint;

use super::link::{self, News};
use super::lobes::LobeMap;
use super::received::Received;
use crate::device::{Client, DeviceError};
use crate::report::answer::VerdictLog;

/// Number of news that wait for a view: a choice above the events of a second. The thread of the device waits when it
/// is full.
const WAITING_NEWS: usize = 4096;

/// Longest wait for the device after a view was closed: a choice above the time of one request that succeeds.
const GOODBYE: Duration = Duration::from_millis(1500);

/// Reason why the state cannot be kept up to date.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LiveError {
    /// The device cannot be reached.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The lobe table is invalid.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The thread of the device ended without news.
    #[error("the thread that receives from the device has ended; please report it")]
    Silent,
}

/// Outcome of a view that has ended.
pub(crate) struct Outcome {
    /// Changes of verdict and advice, and the summary.
    pub(crate) log: VerdictLog,
    /// Number of messages lost on the serial line of the last connection.
    pub(crate) lost_frames: u32,
}

/// The received state, and the news that change it.
pub(crate) struct Live {
    /// Everything that the device has sent so far.
    pub(crate) received: Received,
    news: Receiver<News>,
    stop: Arc<AtomicBool>,
}

impl Live {
    /// Starts the thread of the device at `port`. `connect` makes a connection; `table` holds the bytes of a lobe table
    /// for chart and margin; the thread ends when `stop` is true.
    ///
    /// # Errors
    /// The lobe table is invalid.
    pub(crate) fn start(
        port: &str,
        connect: impl FnMut() -> Result<(Client, Info), DeviceError> + Send + 'static,
        table: Option<Vec<u8>>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, TableError> {
        let mut received = Received::new(port);
        received.lobes = table.map(|bytes| LobeMap::new(bytes, None)).transpose()?;
        let (send, news) = sync_channel(WAITING_NEWS);
        let over = stop.clone();
        std::thread::spawn(move || link::listen(connect, &send, &over));
        Ok(Self {
            received,
            news,
            stop: stop.clone(),
        })
    }

    /// Takes the next piece of news, for which it waits at most `patience`; false if there was none.
    ///
    /// # Errors
    /// The first connection failed, or a later one failed for a reason that a plug does not remove.
    pub(crate) fn take(&mut self, patience: Duration) -> Result<bool, LiveError> {
        match self.news.recv_timeout(patience) {
            Ok(News::Up(identity)) => {
                self.move_to(identity.working_point)?;
                self.received.connected(identity);
            }
            Ok(News::Point(point)) => self.move_to(point)?,
            Ok(News::Event(event)) => self.received.take(&event),
            Ok(News::Gone(error)) => self.received.gone(error.to_string()),
            Ok(News::Failed(error)) => return Err(error.into()),
            Ok(News::Ended(_)) | Err(RecvTimeoutError::Timeout) => return Ok(false),
            // A thread that is stopped before the first connection ends without news.
            Err(RecvTimeoutError::Disconnected) if self.stop.load(Ordering::Relaxed) => return Ok(false),
            Err(RecvTimeoutError::Disconnected) => return Err(LiveError::Silent),
        }
        Ok(true)
    }

    /// Draws the lobes at this working point of the device.
    fn move_to(&mut self, point: Option<WorkingPoint>) -> Result<(), TableError> {
        let lobes = self.received.lobes.take();
        self.received.lobes = lobes.map(|lobes| lobes.at(point)).transpose()?;
        if let Some(identity) = &mut self.received.identity {
            identity.working_point = point;
        }
        Ok(())
    }

    /// Ends the thread of the device, and its subscription, for which it waits [`GOODBYE`] at most.
    pub(crate) fn end(self) -> Outcome {
        self.stop.store(true, Ordering::Relaxed);
        let began = Instant::now();
        let mut lost_frames = 0;
        while let Some(left) = GOODBYE.checked_sub(began.elapsed()) {
            match self.news.recv_timeout(left) {
                Ok(News::Ended(lost)) => {
                    lost_frames = lost;
                    break;
                }
                Ok(_) => {}
                Err(_) => break,
            }
        }
        Outcome {
            log: self.received.log,
            lost_frames,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;

    use quietcut_core::units::{Degrees, Millimeters};

    use super::*;
    use crate::device::port::SerialLine;
    use crate::monitor::received::Identity;
    use crate::monitor::tests::lobes;

    #[test]
    fn the_lobes_follow_the_working_point_of_the_device() {
        let (send, news) = sync_channel(4);
        let mut live = Live {
            received: Received::new("simulated"),
            news,
            stop: Arc::default(),
        };
        live.received.lobes = Some(lobes(None));
        let point = |start| WorkingPoint {
            axial_depth: Millimeters(1.2),
            start: Degrees(start),
            exit: Degrees(180.0),
            feed_per_tooth: Millimeters(0.1),
            posture: 0,
        };
        let mut take = |piece| {
            send.send(piece).unwrap();
            assert!(live.take(Duration::ZERO).unwrap());
            let lobes = live.received.lobes.as_ref().unwrap();
            let known = lobes.columns().iter().flatten().count();
            (lobes.working_depth_mm().map(|depth| depth as f32), known > 0)
        };
        assert_eq!(take(News::Up(Identity::default())), (None, true));
        assert_eq!(take(News::Point(Some(point(90.0)))), (Some(1.2), true));
        // The table has no layer for this immersion.
        assert_eq!(take(News::Point(Some(point(0.0)))), (Some(1.2), false));
        assert_eq!(take(News::Point(None)), (None, true));
    }

    #[test]
    fn a_stop_before_the_first_connection_is_no_fault() {
        let stop = Arc::new(AtomicBool::new(true));
        let connect = || Client::connect(Box::new(SerialLine::open("/dev/no-such-port")?));
        let mut live = Live::start("/dev/no-such-port", connect, None, &stop).unwrap();
        assert!(!live.take(Duration::from_secs(10)).unwrap());
        assert_eq!(live.end().lost_frames, 0);
    }
}
