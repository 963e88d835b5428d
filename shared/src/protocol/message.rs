//! The messages between host and device. The order of variants and fields is part of the protocol: see
//! [`super::version`].

use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

use super::frame::{FrameError, FrameErrors, Message};
use crate::acceleration::{Block, Counts, MAX_BLOCK_SAMPLES, Sensor};
use crate::lobes::format::NAME_CAPACITY;
use crate::lobes::{Header, LobeTable, TableError};
use crate::monitor::{Band, Report, Settings, SettingsError, Strobe};
use crate::tachometer::Edge;
use crate::units::{Degrees, Hertz, Millimeters, Nanoseconds, Rpm};
use crate::working_point::{Limits, WorkingPoint};

/// Largest number of bytes of a lobe table in one [`Request::UploadChunk`].
pub const MAX_CHUNK: usize = 256;
/// Largest number of tachometer edges in one [`Feed`]; further edges precede it in [`Request::FeedEdges`].
pub const MAX_FEED_EDGES: usize = 8;
/// Largest number of tachometer edges in one [`Request::FeedEdges`].
pub const MAX_EDGES: usize = 32;
/// Largest number of tachometer edges that a device holds for one block of fed samples.
pub const MAX_BLOCK_EDGES: usize = 128;
/// Largest number of spectrum bins in one [`SpectrumChunk`].
pub const MAX_CHUNK_BINS: usize = 96;
/// Largest number of points of the stroboscopic map in one [`StrobeChunk`].
pub const MAX_CHUNK_STROBES: usize = 16;
/// Number of table slots of a device: places in its flash that hold one lobe table each.
pub const SLOTS: usize = 2;

/// A request of the host to the device. The device answers each with one [`Reply`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// The buffers of the link have the size of the largest request anyway, and boxing its fields would need an allocator.
#[allow(clippy::large_enum_variant)]
pub enum Request {
    /// Begins a session and restarts the sequence numbers of the requests. Reply: [`Reply::Info`].
    Hello,
    /// Requests the identity of the device. Reply: [`Reply::Info`].
    Info,
    /// Requests the operating status of the device. Reply: [`Reply::Status`].
    Status,
    /// Requests the settings of the signal chain. Reply: [`Reply::Settings`].
    Settings,
    /// Configures the signal chain of the device and resets its state.
    SetSettings(Settings),
    /// Sets the working point (depth, immersion, feed, posture) of the cut; `None` if it is unknown.
    SetWorkingPoint(Option<WorkingPoint>),
    /// Selects the messages that the device sends without a request. After [`Hello`](Self::Hello) there are none.
    Subscribe(Subscription),
    /// Begins or resumes the upload of the lobe table with this file header. Reply: [`Reply::Upload`] with the offset
    /// of the next chunk. A device whose unfinished upload has the same header continues it.
    UploadBegin(Header),
    /// Sends a chunk of the lobe table. Reply: [`Reply::Upload`].
    UploadChunk {
        /// Offset of the chunk in bytes from the start of the lobe table; it must be the next one expected.
        offset: u32,
        /// The bytes of the chunk of the lobe table, at most [`MAX_CHUNK`].
        data: Vec<u8, MAX_CHUNK>,
    },
    /// Requests the progress of the upload of a lobe table, also after a restart of the device. Reply:
    /// [`Reply::Upload`].
    UploadQuery,
    /// Ends the upload: the device checks the lobe table and puts it in use.
    UploadCommit,
    /// Aborts the upload.
    UploadAbort,
    /// A block of acceleration samples that the device processes instead of those of its sensor. The reply comes after
    /// the block is processed: reports, spectra and strobes of the block are sent before it.
    Feed(Feed),
    /// Sends tachometer edges that precede those of the next [`Feed`], in order of time.
    FeedEdges(Vec<Edge, MAX_EDGES>),
    /// Resets the signal chain and makes the device process blocks of its own sensor again.
    Reset,
    /// Sets the feed direction of the cut, from the machine's x axis towards its y axis; `None` if it is unknown. Lobe
    /// tables with layers for several feed directions require it.
    SetFeedDirection(Option<Degrees>),
    /// Requests the feed direction that is set on the device. Reply: [`Reply::FeedDirection`].
    FeedDirection,
}

impl Message for Request {
    const VARIANTS: u8 = 17;
}

/// A message of the device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // As for `Request`.
pub enum Response {
    /// The reply to a request.
    Reply {
        /// Sequence number of the request.
        request: u16,
        /// The reply to that request.
        reply: Reply,
    },
    /// A frame of the host was unreadable, or did not have the expected sequence number.
    FrameRefused(FrameError),
    /// The report of the signal chain on a block of samples.
    Report(Report),
    /// A chunk of a spectrum.
    Spectrum(SpectrumChunk),
    /// Points of the stroboscopic map.
    Strobes(StrobeChunk),
}

impl Message for Response {
    const VARIANTS: u8 = 5;
}

/// The reply to a [`Request`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // As for `Request`.
pub enum Reply {
    /// The request is done.
    Done,
    /// The request is refused.
    Refused(Refusal),
    /// Identity of the device.
    Info(Info),
    /// Operating status of the device.
    Status(Status),
    /// The settings of the signal chain that the device uses.
    Settings(Settings),
    /// Progress of the upload.
    Upload(Upload),
    /// The feed direction that is set on the device; `None` if none is set.
    FeedDirection(Option<Degrees>),
}

/// The reason why the device refuses a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// [`Request::Hello`] must come first.
    HelloFirst,
    /// The settings are invalid.
    Settings(SettingsError),
    /// The working point is invalid: depth and feed must be finite numbers of at least 0, and the entry angle below
    /// the exit angle, both finite.
    WorkingPoint(WorkingPoint),
    /// The lobe table or its header is invalid.
    Table(TableError),
    /// The lobe table is longer than a table slot of the device's flash.
    TableTooLong {
        /// Its length in bytes.
        length: u32,
        /// Capacity of a flash slot for a lobe table, in bytes.
        capacity: u32,
    },
    /// There is no upload of a lobe table to continue.
    NoUpload,
    /// The chunk is not the next one of the lobe table, or extends beyond its end.
    ChunkOffset {
        /// The expected offset.
        expected: u32,
        /// Offset of the chunk.
        found: u32,
        /// Length of the table.
        length: u32,
    },
    /// The received table is incomplete.
    Incomplete {
        /// Bytes received.
        received: u32,
        /// Length of the table.
        length: u32,
    },
    /// Erasing, writing or reading back the flash memory of the device failed.
    Flash,
    /// The host sent more tachometer edges than the device can hold for one block.
    TooManyEdges {
        /// Largest number of edges.
        limit: u16,
    },
    /// The feed direction in the request is not an angle from −360° to 360°.
    FeedDirection(Degrees),
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::HelloFirst => f.write_str("the device was restarted and waits for a hello"),
            Self::Settings(error) => error.fmt(f),
            Self::WorkingPoint(point) => write!(
                f,
                "a cut {} deep, from {} to {}, {} per tooth: depth and feed must be numbers of at least 0, the entry \
                 before the exit",
                point.axial_depth, point.start, point.exit, point.feed_per_tooth
            ),
            Self::Table(error) => error.fmt(f),
            Self::TableTooLong { length, capacity } => {
                write!(
                    f,
                    "a table of {length} bytes: a slot of the device holds {capacity}"
                )
            }
            Self::NoUpload => f.write_str("no upload has begun"),
            Self::ChunkOffset {
                expected,
                found,
                length,
            } => {
                write!(
                    f,
                    "a piece at byte {found} of {length} where the one at {expected} was due"
                )
            }
            Self::Incomplete { received, length } => {
                write!(f, "only {received} of the {length} bytes of the table have come")
            }
            Self::Flash => f.write_str("the flash memory of the device does not keep what is written to it"),
            Self::TooManyEdges { limit } => {
                write!(f, "more than {limit} tachometer edges for one block of samples")
            }
            Self::FeedDirection(direction) => {
                write!(
                    f,
                    "a feed towards {direction}: an angle from -360 to 360 degrees is needed"
                )
            }
        }
    }
}

impl core::error::Error for Refusal {}

/// Identity of a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// Version of the protocol.
    pub protocol: u8,
    /// Name of the board.
    pub board: String<24>,
    /// Version of the firmware.
    pub firmware: String<16>,
    /// The accelerometer of the board; `None` if the board has none.
    pub sensor: Option<Sensor>,
    /// Largest length of a lobe table that fits into a slot, in bytes.
    pub slot_capacity: u32,
    /// Contents of the flash slots for lobe tables, in the order of their addresses.
    pub slots: [Slot; SLOTS],
    /// The table in use; `None` if there is none.
    pub table: Option<TableSummary>,
}

/// Content of a slot in the device's flash for a lobe table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Slot {
    /// The slot is empty.
    Empty,
    /// The slot holds an incomplete upload, with its progress.
    Unfinished(Upload),
    /// The slot holds bytes that are not a valid lobe table, for the given reason.
    Damaged(TableError),
    /// The slot holds a valid lobe table that is not in use.
    Valid(Header),
    /// The table in use.
    InUse(Header),
}

/// Summary of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableSummary {
    /// Name of the case.
    pub name: String<NAME_CAPACITY>,
    /// Number of teeth of the tool for which the lobe table was computed.
    pub teeth: u8,
    /// Speed limits of the machine that the lobe table states, if it has any.
    pub limits: Option<Limits>,
    /// Number of speeds.
    pub speeds: u16,
    /// The slowest speed.
    pub speed_from: Rpm,
    /// The fastest speed.
    pub speed_to: Rpm,
    /// The smallest depth.
    pub depth_from: Millimeters,
    /// The largest depth.
    pub depth_to: Millimeters,
    /// Number of layers.
    pub layers: u16,
}

impl TableSummary {
    /// The summary of a table.
    pub fn of(table: &LobeTable<'_>) -> Self {
        let (depth_from, depth_to) = table.depths();
        Self {
            name: String::try_from(table.name()).unwrap_or_default(),
            teeth: table.teeth(),
            limits: table.limits(),
            speeds: table.speeds().len() as u16,
            speed_from: table.speeds().next().unwrap_or_default(),
            speed_to: table.speeds().next_back().unwrap_or_default(),
            depth_from,
            depth_to,
            layers: table.layers().len() as u16,
        }
    }
}

/// Operating status of a device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Time since the start of the device.
    pub uptime: Nanoseconds,
    /// Number of sample blocks processed since the start of the device.
    pub blocks: u32,
    /// Number of clipped samples since the signal chain was configured or reset.
    pub clipped: u32,
    /// Number of lost samples since the signal chain was configured or reset.
    pub lost: u32,
    /// True if the processed samples come from the host, false if they come from the device's sensor.
    pub is_fed: bool,
    /// The working point of the cut that is set on the device, if any.
    pub working_point: Option<WorkingPoint>,
    /// The messages that the device sends without a request.
    pub subscription: Subscription,
    /// Number of readable frames received from the host.
    pub frames: u32,
    /// Numbers of refused frames from the host.
    pub frame_errors: FrameErrors,
    /// Number of reports, spectra and sets of the stroboscopic points of one block that were dropped, as a whole or in
    /// part, because the line is too slow.
    pub dropped: u32,
}

/// The reports that the device sends without a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reports {
    /// No reports.
    #[default]
    None,
    /// Only the reports whose verdict, reason or advice differs from the preceding one.
    Changes,
    /// All reports.
    All,
}

/// Selection of the messages that the device sends without a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Subscription {
    /// The reports to send.
    pub reports: Reports,
    /// True to send each new spectrum of the bands.
    pub spectra: bool,
    /// True to send the points of the stroboscopic map of each block.
    pub strobes: bool,
}

/// Progress of the upload of a lobe table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Upload {
    /// Header of the file.
    pub header: Header,
    /// Number of bytes received from the start of the lobe table, its header included: the offset of the next chunk.
    pub received: u32,
}

/// A block of acceleration samples that the host feeds to the device.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Feed {
    sequence: u32,
    time: Nanoseconds,
    lost: u32,
    clipped: u16,
    /// Counts of x, y and z as six bytes per sample, little-endian, oldest sample first. With the variable-length
    /// integers of postcard, a block of large counts would exceed the frame.
    counts: Vec<[u8; 6], MAX_BLOCK_SAMPLES>,
    /// Tachometer edges from the host up to the end of the block, in order of time. They follow those of
    /// [`Request::FeedEdges`].
    pub edges: Vec<Edge, MAX_FEED_EDGES>,
}

impl Feed {
    /// The message that feeds the samples of `block` with the tachometer edges `edges` to the device.
    pub fn new(block: &Block, edges: Vec<Edge, MAX_FEED_EDGES>) -> Self {
        Self {
            sequence: block.sequence,
            time: block.time,
            lost: block.lost,
            clipped: block.clipped,
            counts: block.counts.iter().copied().map(bytes_of).collect(),
            edges,
        }
    }

    /// The block.
    pub fn block(&self) -> Block {
        Block {
            sequence: self.sequence,
            time: self.time,
            lost: self.lost,
            clipped: self.clipped,
            counts: self.counts.iter().copied().map(counts_of).collect(),
        }
    }
}

fn bytes_of([x, y, z]: Counts) -> [u8; 6] {
    let ([a, b], [c, d], [e, f]) = (x.to_le_bytes(), y.to_le_bytes(), z.to_le_bytes());
    [a, b, c, d, e, f]
}

fn counts_of([a, b, c, d, e, f]: [u8; 6]) -> Counts {
    [
        i16::from_le_bytes([a, b]),
        i16::from_le_bytes([c, d]),
        i16::from_le_bytes([e, f]),
    ]
}

/// A chunk of a spectrum. The chunks of one spectrum are sent in order; other messages, and chunks of the spectrum of
/// the other band, may come between them. The rest of a spectrum is dropped once a newer one of its band is complete.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectrumChunk {
    /// The frequency band of the spectrum.
    pub band: Band,
    /// Sequence number of the block of samples that completed the spectrum.
    pub sequence: u32,
    /// Width of a bin.
    pub bin: Hertz,
    /// Number of bins of the whole spectrum.
    pub bins: u16,
    /// Index of the first spectrum bin in this chunk.
    pub first: u16,
    /// Power per bin from bin `first` on, in (m/s²)².
    pub power: Vec<f32, MAX_CHUNK_BINS>,
}

/// Points of the stroboscopic map from one block, all or some of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrobeChunk {
    /// Sequence number of the block.
    pub sequence: u32,
    /// The points, oldest first.
    pub strobes: Vec<Strobe, MAX_CHUNK_STROBES>,
}
