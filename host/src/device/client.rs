//! Client of the protocol: it sends one request at a time, repeats it a few times if no reply arrives, and queues the
//! events that the device sends without a request.

use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use quietcut_core::monitor::{Report, Settings};
use quietcut_core::protocol::{
    Decoder, FrameError, Info, MAX_FRAME, Reply, Request, Response, Sequence, SpectrumChunk, Status,
    StrobeChunk, Subscription, VERSION, encode,
};
use quietcut_core::units::Degrees;
use quietcut_core::working_point::WorkingPoint;

use super::DeviceError;
use super::port::Port;

/// Number of transmissions of a request before the device counts as not answering: a choice.
const ATTEMPTS: u32 = 4;

/// Longest wait for a reply: the emulated board needs about 1 s for its first reply over a pseudo-terminal.
const REPLY: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 1200 });

/// Longest wait for a reply that follows an erasure of flash memory: a choice far above the 22 ms of a page and the
/// processing of waiting blocks.
pub(super) const REPLY_AFTER_ERASE: Duration = Duration::from_secs(3);

/// Longest wait for the reply to a request after an unreadable frame: a choice.
const AFTER_NOISE: Duration = Duration::from_millis(if cfg!(test) { 10 } else { 150 });

/// Longest time to send one frame: a choice above the 0.55 s of the largest frame at 9600 bit/s.
const SEND: Duration = Duration::from_secs(2);

/// Message that the device sends without a request.
#[derive(Clone, Debug, PartialEq)]
// The largest variant sets the size of an event. Most events are reports, and the queue of received events holds only a
// few, so that little memory is wasted.
#[allow(clippy::large_enum_variant)]
pub enum Event {
    /// Report that the signal chain of the device gives after a block of samples.
    Report(Report),
    /// Chunk of a power spectrum.
    Spectrum(SpectrumChunk),
    /// Points of the stroboscopic map, one per tooth passing.
    Strobes(StrobeChunk),
}

/// Connection to a device.
pub struct Client {
    port: Box<dyn Port>,
    decoder: Decoder,
    requests: Sequence,
    responses: Sequence,
    events: VecDeque<Event>,
    lost_frames: u32,
}

impl Client {
    /// Connects to the device at `port` with the request hello.
    ///
    /// # Errors
    /// The port fails, or no quietcut device of this protocol version answers.
    pub fn connect(port: Box<dyn Port>) -> Result<(Self, Info), DeviceError> {
        // Request numbers start at a new value: a device repeats its last reply for a number that it has just answered.
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let mut client = Self {
            port,
            decoder: Decoder::new(),
            requests: Sequence::from((now.as_micros() & 0xffff) as u16),
            responses: Sequence::default(),
            events: VecDeque::new(),
            lost_frames: 0,
        };
        // A zero byte ends a frame that noise may have started.
        client.port.send(&[0], SEND)?;
        let info = client.hello()?;
        // Events received before the reply to hello belong to an earlier connection and are dropped.
        client.events.clear();
        client.lost_frames = 0;
        Ok((client, info))
    }

    /// Name of the port.
    pub fn port(&self) -> &str {
        self.port.name()
    }

    /// Number of frames of the device that did not arrive since the connection, from the gaps in their sequence
    /// numbers.
    pub fn lost_frames(&self) -> u32 {
        self.lost_frames
    }

    /// Sends the request hello again, as needed after a restart of the device.
    pub(super) fn hello(&mut self) -> Result<Info, DeviceError> {
        match self.exchange(&Request::Hello, "hello", REPLY)? {
            Reply::Info(info) if info.protocol == VERSION => Ok(info),
            Reply::Info(info) => Err(self.version(info.protocol)),
            other => Err(self.unexpected("hello", &other)),
        }
    }

    /// Requests the identity, memory slots and lobe table of the device.
    pub fn info(&mut self) -> Result<Info, DeviceError> {
        match self.exchange(&Request::Info, "info", REPLY)? {
            Reply::Info(info) => Ok(info),
            other => Err(self.unexpected("info", &other)),
        }
    }

    /// Requests the status of the device: uptime, counters, working point.
    pub fn status(&mut self) -> Result<Status, DeviceError> {
        match self.exchange(&Request::Status, "status", REPLY)? {
            Reply::Status(status) => Ok(status),
            other => Err(self.unexpected("status", &other)),
        }
    }

    /// Requests the settings of the signal chain.
    pub fn settings(&mut self) -> Result<Settings, DeviceError> {
        match self.exchange(&Request::Settings, "settings", REPLY)? {
            Reply::Settings(settings) => Ok(settings),
            other => Err(self.unexpected("settings", &other)),
        }
    }

    /// Replaces the settings of the signal chain.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), DeviceError> {
        self.command(&Request::SetSettings(settings), "settings")
    }

    /// Sets the working point, or removes it with `None`.
    pub fn set_working_point(&mut self, point: Option<WorkingPoint>) -> Result<(), DeviceError> {
        self.command(&Request::SetWorkingPoint(point), "working point")
    }

    /// Requests the feed direction; `None` if none is set.
    ///
    /// Older firmware does not support this request and is treated as having none. This request must be the last one to
    /// such a device.
    pub fn feed_direction(&mut self) -> Result<Option<Degrees>, DeviceError> {
        match self.exchange(&Request::FeedDirection, "feed direction", REPLY) {
            Ok(Reply::FeedDirection(direction)) => Ok(direction),
            Ok(other) => Err(self.unexpected("feed direction", &other)),
            Err(DeviceError::Frames {
                error: FrameError::UnknownMessage { .. },
                ..
            }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Sets the feed direction, or removes it with `None`.
    pub fn set_feed_direction(&mut self, direction: Option<Degrees>) -> Result<(), DeviceError> {
        self.command(&Request::SetFeedDirection(direction), "feed direction")
    }

    /// Selects the events that the device sends without a request.
    pub fn subscribe(&mut self, subscription: Subscription) -> Result<(), DeviceError> {
        self.command(&Request::Subscribe(subscription), "subscription")
    }

    /// Resets the signal chain of the device to its initial state. The device then processes samples of its sensor
    /// again in place of fed ones.
    pub fn reset(&mut self) -> Result<(), DeviceError> {
        self.command(&Request::Reset, "reset")
    }

    /// Sends a request to which the device replies `Done`, and waits for this reply.
    pub(super) fn command(&mut self, request: &Request, name: &'static str) -> Result<(), DeviceError> {
        self.command_within(request, name, REPLY)
    }

    /// Sends a request to which the device replies `Done`, and waits at most `within` after each transmission.
    pub(super) fn command_within(
        &mut self,
        request: &Request,
        name: &'static str,
        within: Duration,
    ) -> Result<(), DeviceError> {
        match self.exchange(request, name, within)? {
            Reply::Done => Ok(()),
            other => Err(self.unexpected(name, &other)),
        }
    }

    /// Next event of the device, in order; `None` if none arrives within `timeout`.
    pub fn next_event(&mut self, timeout: Duration) -> Result<Option<Event>, DeviceError> {
        let deadline = Instant::now() + timeout;
        while self.events.is_empty() {
            let left = deadline.saturating_duration_since(Instant::now());
            if let Some(ReplyFrame::Version(theirs)) = self.receive(left, None)? {
                return Err(self.version(theirs));
            }
            if left.is_zero() {
                break;
            }
        }
        Ok(self.events.pop_front())
    }

    /// Sends a request, at most [`ATTEMPTS`] times, until its reply arrives; a refusal is an error.
    pub(super) fn exchange(
        &mut self,
        request: &Request,
        name: &'static str,
        within: Duration,
    ) -> Result<Reply, DeviceError> {
        let number = self.requests.take();
        let mut buffer = [0; MAX_FRAME];
        let frame =
            encode(request, number, &mut buffer).map_err(|_| DeviceError::TooLarge { request: name })?;
        let began = Instant::now();
        let mut fault = None;
        for _ in 0..ATTEMPTS {
            self.port.send(frame, SEND)?;
            match self.await_reply(number, within, &mut fault)? {
                Some(Reply::Refused(refusal)) => {
                    return Err(DeviceError::Refused {
                        port: self.port.name().into(),
                        request: name,
                        refusal,
                    });
                }
                Some(reply) => return Ok(reply),
                None => {}
            }
        }
        let port = self.port.name().to_owned();
        Err(match fault {
            Some(error) => DeviceError::Frames {
                port,
                request: name,
                attempts: ATTEMPTS,
                error,
            },
            None => DeviceError::NoAnswer {
                port,
                request: name,
                waited: began.elapsed(),
                attempts: ATTEMPTS,
            },
        })
    }

    /// Waits for the reply to request `number`; `None` if no usable reply came, so that the request must be sent again.
    fn await_reply(
        &mut self,
        number: u16,
        within: Duration,
        fault: &mut Option<FrameError>,
    ) -> Result<Option<Reply>, DeviceError> {
        let mut deadline = Instant::now() + within;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.receive(left, Some(number))? {
                Some(ReplyFrame::Reply(reply)) => return Ok(Some(reply)),
                Some(ReplyFrame::Version(theirs)) => return Err(self.version(theirs)),
                Some(ReplyFrame::Unreadable(error)) => {
                    tracing::debug!("{}: request {number}: {error}", self.port.name());
                    *fault = Some(error);
                    // An unreadable frame may have been a report that arrived just before the awaited reply: the wait
                    // goes on for a short time.
                    deadline = deadline.min(Instant::now() + AFTER_NOISE);
                }
                Some(ReplyFrame::Again(error)) => {
                    tracing::debug!("{}: request {number} came as {error}", self.port.name());
                    *fault = Some(error);
                    return Ok(None);
                }
                None => {}
            }
            if left.is_zero() {
                return Ok(None);
            }
        }
    }

    /// Reads the serial line once, for at most `timeout`. Returns the completed frame that concerns the request with
    /// this number, or an unreadable one; `None` if neither was completed.
    fn receive(&mut self, timeout: Duration, number: Option<u16>) -> Result<Option<ReplyFrame>, DeviceError> {
        // A buffer avoids one system call per byte; all bytes in it are decoded before the reply is returned.
        let mut bytes = [0; 256];
        let count = self.port.receive(&mut bytes, timeout)?;
        let mut answer = None;
        for &byte in bytes.get(..count).unwrap_or_default() {
            let Some(frame) = self.decoder.push(byte) else {
                continue;
            };
            let decoded = frame.and_then(|frame| Ok((frame.sequence, frame.message::<Response>()?)));
            let next = match decoded {
                Ok((sequence, response)) => self.sort(sequence, response, number),
                Err(FrameError::Version { theirs, .. }) => Some(ReplyFrame::Version(theirs)),
                Err(error) => Some(ReplyFrame::Unreadable(error)),
            };
            // A reply has priority over unreadable frames around it.
            if !matches!(answer, Some(ReplyFrame::Reply(_) | ReplyFrame::Version(_))) {
                answer = next.or(answer);
            }
        }
        Ok(answer)
    }

    /// Queues an event of the device. Returns a reply to the request with this number, or the refusal of a frame;
    /// otherwise `None`.
    fn sort(&mut self, sequence: u16, response: Response, number: Option<u16>) -> Option<ReplyFrame> {
        let order = self.responses.check(sequence);
        if let Err(FrameError::OutOfOrder { expected, found }) = order {
            self.lost_frames = self
                .lost_frames
                .saturating_add(u32::from(found.wrapping_sub(expected)));
            self.responses.restart_after(found);
        }
        match response {
            Response::Report(report) => self.events.push_back(Event::Report(report)),
            Response::Spectrum(chunk) => self.events.push_back(Event::Spectrum(chunk)),
            Response::Strobes(chunk) => self.events.push_back(Event::Strobes(chunk)),
            Response::FrameRefused(FrameError::Version { ours: theirs, .. }) => {
                return Some(ReplyFrame::Version(theirs));
            }
            Response::FrameRefused(error) => return Some(ReplyFrame::Again(error)),
            // Drops a reply to another request, such as a second reply to an earlier request that was repeated.
            Response::Reply { request, .. } if Some(request) != number => {}
            Response::Reply { reply, .. } => {
                return Some(match order {
                    Ok(()) => ReplyFrame::Reply(reply),
                    // Frames before this reply were lost: the request is sent again, and the device repeats its reply.
                    Err(error) => ReplyFrame::Again(error),
                });
            }
        }
        None
    }

    fn version(&self, theirs: u8) -> DeviceError {
        DeviceError::Version {
            port: self.port.name().into(),
            ours: VERSION,
            theirs,
        }
    }

    pub(super) fn unexpected(&self, request: &'static str, reply: &Reply) -> DeviceError {
        let reply = match reply {
            Reply::Done => "done",
            Reply::Refused(_) => "refused",
            Reply::Info(_) => "info",
            Reply::Status(_) => "status",
            Reply::Settings(_) => "settings",
            Reply::Upload(_) => "upload",
            Reply::FeedDirection(_) => "feed direction",
        };
        DeviceError::Unexpected {
            port: self.port.name().into(),
            request,
            reply,
        }
    }
}

/// Received frame that concerns a waiting request.
enum ReplyFrame {
    Reply(Reply),
    /// The received frame cannot be decoded.
    Unreadable(FrameError),
    /// The request must be sent again: the device refused its frame, or frames before the reply were lost.
    Again(FrameError),
    /// The device uses another version of the protocol: the one stated.
    Version(u8),
}
