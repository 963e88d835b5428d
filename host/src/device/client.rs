//! The host's side of the protocol: one request at a time, repeated until it is answered, and what the device sends by
//! itself in between.

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

/// How often a request is sent before the device counts as silent.
const ATTEMPTS: u32 = 4;

/// The longest that a device takes to answer: the emulated one needs about a second for the first reply behind a
/// pseudo-terminal.
const REPLY: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 1200 });

/// The same where flash memory may be erased first: a page in 22 ms, and before it the blocks that wait; and many times as much.
pub(super) const REPLY_AFTER_ERASE: Duration = Duration::from_secs(3);

/// How long an answer is still waited for behind a frame that cannot be read.
const AFTER_NOISE: Duration = Duration::from_millis(if cfg!(test) { 10 } else { 150 });

/// The longest that the line takes to swallow one frame: at 9600 bit/s the largest takes 0.6 s.
const SEND: Duration = Duration::from_secs(2);

/// What a device sends without being asked.
#[derive(Clone, Debug, PartialEq)]
// Most events are reports, and no more than a few wait at a time.
#[allow(clippy::large_enum_variant)]
pub enum Event {
    /// What the pipeline says of a block.
    Report(Report),
    /// A piece of a spectrum.
    Spectrum(SpectrumChunk),
    /// Points of the stroboscopic map.
    Strobes(StrobeChunk),
}

/// A device that has answered.
pub struct Client {
    port: Box<dyn Port>,
    decoder: Decoder,
    requests: Sequence,
    responses: Sequence,
    events: VecDeque<Event>,
    lost_frames: u32,
}

impl Client {
    /// Says hello to the device at `port`.
    ///
    /// # Errors
    /// Where no quietcut device of this protocol version answers.
    pub fn connect(port: Box<dyn Port>) -> Result<(Self, Info), DeviceError> {
        // Numbers that no earlier run has used: a device repeats its reply to a number that it has just answered.
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let mut client = Self {
            port,
            decoder: Decoder::new(),
            requests: Sequence::from((now.as_micros() & 0xffff) as u16),
            responses: Sequence::default(),
            events: VecDeque::new(),
            lost_frames: 0,
        };
        // A zero ends what noise may have begun.
        client.port.send(&[0], SEND)?;
        let info = client.hello()?;
        // What was on the line before belongs to another session.
        client.events.clear();
        client.lost_frames = 0;
        Ok((client, info))
    }

    /// The name of the port.
    pub fn port(&self) -> &str {
        self.port.name()
    }

    /// Frames that the device has sent and that did not arrive.
    pub fn lost_frames(&self) -> u32 {
        self.lost_frames
    }

    /// Begins anew, as after a restart of the device.
    pub(super) fn hello(&mut self) -> Result<Info, DeviceError> {
        match self.exchange(&Request::Hello, "hello", REPLY)? {
            Reply::Info(info) if info.protocol == VERSION => Ok(info),
            Reply::Info(info) => Err(self.version(info.protocol)),
            other => Err(self.unexpected("hello", &other)),
        }
    }

    /// Who the device is, and what it has.
    pub fn info(&mut self) -> Result<Info, DeviceError> {
        match self.exchange(&Request::Info, "info", REPLY)? {
            Reply::Info(info) => Ok(info),
            other => Err(self.unexpected("info", &other)),
        }
    }

    /// How the device is.
    pub fn status(&mut self) -> Result<Status, DeviceError> {
        match self.exchange(&Request::Status, "status", REPLY)? {
            Reply::Status(status) => Ok(status),
            other => Err(self.unexpected("status", &other)),
        }
    }

    /// The settings of the device's pipeline.
    pub fn settings(&mut self) -> Result<Settings, DeviceError> {
        match self.exchange(&Request::Settings, "settings", REPLY)? {
            Reply::Settings(settings) => Ok(settings),
            other => Err(self.unexpected("settings", &other)),
        }
    }

    /// Sets the pipeline up anew.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), DeviceError> {
        self.tell(&Request::SetSettings(settings), "settings")
    }

    /// Tells the working point, or that it is not known.
    pub fn set_working_point(&mut self, point: Option<WorkingPoint>) -> Result<(), DeviceError> {
        self.tell(&Request::SetWorkingPoint(point), "working point")
    }

    /// The feed direction, as told.
    ///
    /// A device with older firmware does not know the question; it was told none. It must be the last that is asked of such a device.
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

    /// Tells the feed direction, or that it is not known.
    pub fn set_feed_direction(&mut self, direction: Option<Degrees>) -> Result<(), DeviceError> {
        self.tell(&Request::SetFeedDirection(direction), "feed direction")
    }

    /// Says what the device shall send by itself.
    pub fn subscribe(&mut self, subscription: Subscription) -> Result<(), DeviceError> {
        self.tell(&Request::Subscribe(subscription), "subscription")
    }

    /// Forgets what the pipeline has learned and lets it listen to the sensor again.
    pub fn reset(&mut self) -> Result<(), DeviceError> {
        self.tell(&Request::Reset, "reset")
    }

    /// A request that is answered by "done".
    pub(super) fn tell(&mut self, request: &Request, name: &'static str) -> Result<(), DeviceError> {
        self.tell_within(request, name, REPLY)
    }

    /// The same, for a request that takes longer.
    pub(super) fn tell_within(
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

    /// What the device sent by itself, in order; `None` where nothing came within `timeout`.
    pub fn next_event(&mut self, timeout: Duration) -> Result<Option<Event>, DeviceError> {
        let deadline = Instant::now() + timeout;
        while self.events.is_empty() {
            let left = deadline.saturating_duration_since(Instant::now());
            if let Some(Answer::Version(theirs)) = self.receive(left, None)? {
                return Err(self.version(theirs));
            }
            if left.is_zero() {
                break;
            }
        }
        Ok(self.events.pop_front())
    }

    /// Sends a request until it is answered; refusals are errors.
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

    /// Waits for the reply to a request that was sent; `None` where it must be sent again.
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
                Some(Answer::Reply(reply)) => return Ok(Some(reply)),
                Some(Answer::Version(theirs)) => return Err(self.version(theirs)),
                Some(Answer::Unreadable(error)) => {
                    tracing::debug!("{}: request {number}: {error}", self.port.name());
                    *fault = Some(error);
                    // It may have been a report, with the answer just behind it.
                    deadline = deadline.min(Instant::now() + AFTER_NOISE);
                }
                Some(Answer::Again(error)) => {
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

    /// Takes what comes within `timeout`, up to the first thing that matters to a request with this number.
    fn receive(&mut self, timeout: Duration, number: Option<u16>) -> Result<Option<Answer>, DeviceError> {
        // One byte at a time out of a small buffer would cost a system call each; what is behind an answer is decoded
        // before the answer is given.
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
                Err(FrameError::Version { theirs, .. }) => Some(Answer::Version(theirs)),
                Err(error) => Some(Answer::Unreadable(error)),
            };
            // A reply counts more than the noise around it.
            if !matches!(answer, Some(Answer::Reply(_) | Answer::Version(_))) {
                answer = next.or(answer);
            }
        }
        Ok(answer)
    }

    /// Puts events into the queue; gives back what answers the request with this number.
    fn sort(&mut self, sequence: u16, response: Response, number: Option<u16>) -> Option<Answer> {
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
                return Some(Answer::Version(theirs));
            }
            Response::FrameRefused(error) => return Some(Answer::Again(error)),
            // An answer to a request that was repeated meanwhile.
            Response::Reply { request, .. } if Some(request) != number => {}
            Response::Reply { reply, .. } => {
                return Some(match order {
                    Ok(()) => Answer::Reply(reply),
                    // The device repeats its reply when it is asked again: a whole exchange leaves no doubt.
                    Err(error) => Answer::Again(error),
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

/// What bears on a request that waits.
enum Answer {
    Reply(Reply),
    /// A frame that cannot be read came.
    Unreadable(FrameError),
    /// The frame must be sent again.
    Again(FrameError),
    /// The other side speaks another version.
    Version(u8),
}
