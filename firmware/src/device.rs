//! The device without pins: signal chain, table slots and link to the host.
//!
//! Boards, the emulator and the host's simulated port all drive the same [`Device`]:
//!
//! ```text
//! loop {
//!     if let Some((block, edges)) = the sensor has a block { device.take(block, edges) }
//!     device.poll(&mut line)?;              // or receive, outgoing and sent, if the caller moves the bytes
//! }
//! ```
//!
//! Only the flash makes the device wait: a request of an upload may erase a page. A board with a
//! sensor therefore takes the waiting blocks, with only [`flush`](Device::flush) between them, before it
//! [`poll`](Device::poll)s for the next request.
//!
//! Requests of the host are done one at a time, in order; see [`quietcut_core::protocol`]. While the host feeds
//! blocks, those of the sensor are ignored.

mod outbox;

use heapless::Vec;
use quietcut_core::acceleration::{Block, Sensor};
use quietcut_core::advice::Advice;
use quietcut_core::detector::{Reason, Verdict};
use quietcut_core::monitor::{Monitor, Report, Settings, SettingsError, State};
use quietcut_core::protocol::message::{MAX_BLOCK_EDGES, TableSummary};
use quietcut_core::protocol::{
    Info, Refusal, Reply, Reports, Request, Response, Sequence, Status, Subscription, VERSION,
};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::{Degrees, Nanoseconds};
use quietcut_core::working_point::WorkingPoint;

use crate::link::{Line, Link};
use crate::storage::{Storage, TableMemory};
use outbox::Outbox;

/// The clock that gives the uptime of the device.
pub trait Clock {
    /// Time since the start of the device, in nanoseconds.
    fn now(&self) -> Nanoseconds;
}

/// Identity of a board.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Name of the board on which the device runs; the host gets an empty name if it has more than 24 bytes.
    pub board: &'static str,
    /// The accelerometer of the board; `None` if the board has none.
    pub sensor: Option<Sensor>,
}

/// A chatter monitor: signal chain, table slots and link to the host.
pub struct Device<'a, M, C> {
    identity: Identity,
    clock: C,
    storage: Storage<M>,
    monitor: Monitor,
    state: &'a mut State,
    working_point: Option<WorkingPoint>,
    feed_direction: Option<Degrees>,
    link: Link,
    session: Session,
    outbox: Outbox,
    subscription: Subscription,
    /// Verdict, reason and advice of the last report while the host subscribes to changes; `None` before the first
    /// report after a reset of the signal chain or a new subscription.
    last_sent: Option<ReportKey>,
    /// Tachometer edges received from the host for the next block of samples that it feeds, in order of arrival.
    edges: Vec<Edge, MAX_BLOCK_EDGES>,
    is_fed: bool,
    blocks: u32,
    clipped: u32,
    lost: u32,
    /// Bytes that were read from the line to the host and are not yet processed.
    input: Vec<u8, 64>,
}

/// Verdict, reason and advice of a report. A host that subscribes to changes receives a report only if one of these
/// has changed.
type ReportKey = (Verdict, Reason, Option<Advice>);

/// The session of one host.
#[derive(Default)]
struct Session {
    is_open: bool,
    requests: Sequence,
    /// Sequence number and reply of the last answered request. The reply is sent again if the host repeats the
    /// request. `None` before the first reply.
    last: Option<(u16, Reply)>,
}

impl<'a, M: TableMemory, C: Clock> Device<'a, M, C> {
    /// Creates a device and resets `state`, the state of its signal chain.
    ///
    /// The state is borrowed because it is large: a board keeps it in static memory.
    ///
    /// # Errors
    /// The settings of the signal chain are invalid.
    pub fn new(
        identity: Identity,
        settings: Settings,
        state: &'a mut State,
        memory: M,
        clock: C,
    ) -> Result<Self, SettingsError> {
        let mut device = Self {
            identity,
            clock,
            storage: Storage::new(memory),
            monitor: Monitor::new(settings)?,
            state,
            working_point: None,
            feed_direction: None,
            link: Link::new(),
            session: Session::default(),
            outbox: Outbox::default(),
            subscription: Subscription::default(),
            last_sent: None,
            edges: Vec::new(),
            is_fed: false,
            blocks: 0,
            clipped: 0,
            lost: 0,
            input: Vec::new(),
        };
        device.restart();
        Ok(device)
    }

    /// Processes a block of samples from the sensor, with the new tachometer edges up to its end.
    ///
    /// The block is ignored while the host feeds blocks.
    pub fn take(&mut self, block: &Block, edges: &[Edge]) {
        if !self.is_fed {
            self.step(block, edges);
            self.pump();
        }
    }

    /// Sends as many bytes as the line to the host accepts, and receives until at least one readable frame of the
    /// host is processed or no further byte can be. Returns true if any byte was sent or processed; the caller then
    /// calls it again.
    ///
    /// # Errors
    /// Reading from or writing to the line fails.
    pub fn poll<IO: Line>(&mut self, line: &mut IO) -> Result<bool, IO::Error> {
        let mut is_busy = self.link.flush(line)?;
        loop {
            if self.input.is_empty() && line.read_ready()? {
                let mut buffer = [0; 64];
                let count = line.read(&mut buffer)?;
                self.input.extend(buffer.into_iter().take(count));
            }
            let input = core::mem::take(&mut self.input);
            let frames = self.link.frames();
            let count = self.receive(&input);
            self.input.extend(input.iter().copied().skip(count));
            is_busy |= self.link.flush(line)? || count > 0;
            if count == 0 || self.link.frames() != frames {
                return Ok(is_busy);
            }
        }
    }

    /// Sends as many bytes as the line to the host accepts, and receives nothing.
    ///
    /// # Errors
    /// Writing to the line fails.
    pub fn flush<IO: Line>(&mut self, line: &mut IO) -> Result<(), IO::Error> {
        while self.link.flush(line)? {
            self.pump();
        }
        Ok(())
    }

    /// Processes bytes from the host. Returns how many of them it has processed.
    ///
    /// While a reply waits for room in the output queue, or the output queue has no room for two frames, it takes no
    /// further bytes; the caller then calls it again with the rest.
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        let mut taken = 0;
        loop {
            self.pump();
            // The output queue must have room for two frames: the reply to a request, and the refusal of an
            // unreadable frame.
            if self.link.room() < 2 || self.outbox.has_reply() {
                return taken;
            }
            let (count, result) = self.link.receive(bytes.get(taken..).unwrap_or_default());
            taken += count;
            match result {
                None => return taken,
                Some(Ok((sequence, request))) => self.answer(sequence, request),
                Some(Err(error)) => {
                    self.link.send(&Response::FrameRefused(error));
                }
            }
        }
    }

    /// Bytes that wait to be sent to the host, or the first part of them.
    pub fn outgoing(&self) -> &[u8] {
        self.link.outgoing()
    }

    /// Removes the first `count` bytes of [`outgoing`](Self::outgoing), after the caller has sent them.
    pub fn sent(&mut self, count: usize) {
        self.link.sent(count);
        self.pump();
    }

    /// The table slots.
    pub fn storage(&self) -> &Storage<M> {
        &self.storage
    }

    /// Returns the flash memory and drops the rest of the device.
    pub fn into_memory(self) -> M {
        self.storage.into_memory()
    }

    /// Moves waiting messages to the output queue of the link to the host, as far as it has room.
    fn pump(&mut self) {
        if let Some(reply) = self.outbox.pump(&mut self.link, self.state) {
            self.session.last = Some(reply);
        }
    }

    /// Resets the signal chain and the numbers of clipped and lost samples. Discards the held tachometer edges, and
    /// the messages that wait for room in the output queue to the host.
    fn restart(&mut self) {
        self.state.reset();
        self.outbox.clear();
        self.edges.clear();
        self.last_sent = None;
        (self.clipped, self.lost) = (0, 0);
    }

    fn step(&mut self, block: &Block, edges: &[Edge]) {
        self.outbox.drop_overwritten();
        let table = self.storage.table().map(|table| match self.feed_direction {
            Some(direction) => table.towards(direction),
            None => table,
        });
        let report = self.monitor.step(
            self.state,
            block,
            edges,
            table.as_ref(),
            self.working_point.as_ref(),
        );
        self.blocks = self.blocks.saturating_add(1);
        (self.clipped, self.lost) = (report.clipped, report.lost);
        let report = self.is_wanted(&report).then_some(report);
        self.outbox
            .fill(report, block.sequence, self.state, self.subscription);
    }

    fn is_wanted(&mut self, report: &Report) -> bool {
        match self.subscription.reports {
            Reports::None => false,
            Reports::All => true,
            Reports::Changes => {
                let current = Some((report.judgement.verdict, report.judgement.reason, report.advice));
                core::mem::replace(&mut self.last_sent, current) != current
            }
        }
    }

    /// Performs a request of the host and queues the reply. A repeated request is not performed again; it gets the last
    /// reply. A request with an unexpected sequence number is refused.
    fn answer(&mut self, sequence: u16, request: Request) {
        if request == Request::Hello {
            self.begin_session(sequence);
        } else if !self.session.is_open {
            return self.outbox.reply(sequence, Reply::Refused(Refusal::HelloFirst));
        } else if let Some((last, reply)) = &self.session.last
            && *last == sequence
        {
            return self.outbox.reply(sequence, reply.clone());
        } else if let Err(error) = self.session.requests.check(sequence) {
            self.link.count(&error);
            self.link.send(&Response::FrameRefused(error));
            return;
        }
        let is_feed = matches!(request, Request::Feed(_));
        let reply = self.perform(request).unwrap_or_else(Reply::Refused);
        if is_feed {
            self.outbox.reply_last(sequence, reply);
        } else {
            self.outbox.reply(sequence, reply);
        }
    }

    /// Begins a session with a host: ends subscription and feed of the preceding session.
    fn begin_session(&mut self, sequence: u16) {
        self.session = Session {
            is_open: true,
            requests: Sequence::default(),
            last: None,
        };
        self.session.requests.restart_after(sequence);
        self.subscription = Subscription::default();
        if self.is_fed {
            self.is_fed = false;
            self.restart();
        }
    }

    fn perform(&mut self, request: Request) -> Result<Reply, Refusal> {
        match request {
            Request::Hello | Request::Info => return Ok(Reply::Info(self.info())),
            Request::Status => return Ok(Reply::Status(self.status())),
            Request::Settings => return Ok(Reply::Settings(*self.monitor.settings())),
            Request::SetSettings(settings) => {
                self.monitor = Monitor::new(settings).map_err(Refusal::Settings)?;
                self.restart();
            }
            Request::SetWorkingPoint(point) => self.working_point = checked(point)?,
            Request::SetFeedDirection(direction) => self.feed_direction = checked_direction(direction)?,
            Request::FeedDirection => return Ok(Reply::FeedDirection(self.feed_direction)),
            Request::Subscribe(subscription) => {
                self.subscription = subscription;
                self.last_sent = None;
            }
            Request::UploadBegin(header) => return self.storage.begin(header).map(Reply::Upload),
            Request::UploadChunk { offset, data } => {
                return self.storage.chunk(offset, &data).map(Reply::Upload);
            }
            Request::UploadQuery => return self.storage.upload().map(Reply::Upload),
            Request::UploadCommit => self.storage.commit()?,
            Request::UploadAbort => self.storage.abort()?,
            Request::Feed(feed) => {
                self.hold(&feed.edges)?;
                self.feed(&feed.block());
            }
            Request::FeedEdges(edges) => self.hold(&edges)?,
            Request::Reset => {
                self.is_fed = false;
                self.restart();
            }
        }
        Ok(Reply::Done)
    }

    /// Stores tachometer edges for the next block that the host feeds: all of them, or none if they are too many.
    fn hold(&mut self, edges: &[Edge]) -> Result<(), Refusal> {
        self.edges
            .extend_from_slice(edges)
            .map_err(|_| Refusal::TooManyEdges {
                limit: MAX_BLOCK_EDGES as u16,
            })
    }

    fn feed(&mut self, block: &Block) {
        let edges = core::mem::take(&mut self.edges);
        if !self.is_fed {
            // The signal chain is reset, because its state must not contain blocks of both the sensor and the host.
            self.restart();
            self.is_fed = true;
        }
        self.step(block, &edges);
    }

    fn info(&self) -> Info {
        Info {
            protocol: VERSION,
            board: self.identity.board.try_into().unwrap_or_default(),
            firmware: env!("CARGO_PKG_VERSION").try_into().unwrap_or_default(),
            sensor: self.identity.sensor,
            slot_capacity: self.storage.slot_capacity(),
            slots: self.storage.slots(),
            table: self.storage.table().map(|table| TableSummary::of(&table)),
        }
    }

    fn status(&self) -> Status {
        Status {
            uptime: self.clock.now(),
            blocks: self.blocks,
            clipped: self.clipped,
            lost: self.lost,
            is_fed: self.is_fed,
            working_point: self.working_point,
            subscription: self.subscription,
            frames: self.link.frames(),
            frame_errors: *self.link.errors(),
            dropped: self.outbox.dropped(),
        }
    }
}

/// Checks a working point from the host: axial depth and feed per tooth finite and at least 0, both angles finite,
/// the entry angle below the exit angle.
fn checked(point: Option<WorkingPoint>) -> Result<Option<WorkingPoint>, Refusal> {
    let Some(cut) = point else { return Ok(None) };
    let is_length = |mm: f32| mm >= 0.0 && mm.is_finite();
    let is_cut = is_length(cut.axial_depth.0)
        && is_length(cut.feed_per_tooth.0)
        && cut.start.0.is_finite()
        && cut.exit.0.is_finite()
        && cut.start < cut.exit;
    if is_cut {
        Ok(point)
    } else {
        Err(Refusal::WorkingPoint(cut))
    }
}

/// Checks that a feed direction from the host is an angle from −360° to 360°.
fn checked_direction(direction: Option<Degrees>) -> Result<Option<Degrees>, Refusal> {
    match direction {
        // The negated comparison also refuses a feed direction that is NaN.
        Some(direction) if !(-360.0..=360.0).contains(&direction.0) => Err(Refusal::FeedDirection(direction)),
        _ => Ok(direction),
    }
}
