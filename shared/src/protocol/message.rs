//! What host and device say to each other. The order of variants and fields is part of the protocol: see [`super::version`].

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

/// The most bytes of a table in one [`Request::UploadChunk`].
pub const MAX_CHUNK: usize = 256;
/// The most edges in one [`Feed`]; more go before it in [`Request::FeedEdges`].
pub const MAX_FEED_EDGES: usize = 8;
/// The most edges in one [`Request::FeedEdges`].
pub const MAX_EDGES: usize = 32;
/// The most edges that a device holds for one block.
pub const MAX_BLOCK_EDGES: usize = 128;
/// The most bins in one [`SpectrumChunk`].
pub const MAX_CHUNK_BINS: usize = 96;
/// The most points in one [`StrobeChunk`].
pub const MAX_CHUNK_STROBES: usize = 16;
/// Number of table slots of a device.
pub const SLOTS: usize = 2;

/// What the host asks of the device. Each gets one [`Reply`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// The largest is what the link's buffers are made for; a box would need an allocator.
#[allow(clippy::large_enum_variant)]
pub enum Request {
    /// Begins to talk; restarts the count of requests. Reply: [`Reply::Info`].
    Hello,
    /// Asks who the device is. Reply: [`Reply::Info`].
    Info,
    /// Asks how the device is. Reply: [`Reply::Status`].
    Status,
    /// Asks for the settings of the pipeline. Reply: [`Reply::Settings`].
    Settings,
    /// Sets the pipeline up anew; what it has learned is forgotten.
    SetSettings(Settings),
    /// Tells the working point, or that it is not known.
    SetWorkingPoint(Option<WorkingPoint>),
    /// Says what the device shall send by itself; nothing after [`Hello`](Self::Hello).
    Subscribe(Subscription),
    /// Begins to send a table, or goes on with one: the header is that of the file. Reply: [`Reply::Upload`], which says where to
    /// go on: a device that holds a part of the same table keeps it.
    UploadBegin(Header),
    /// A piece of the table. Reply: [`Reply::Upload`].
    UploadChunk {
        /// Where it belongs, in bytes from the start of the file; must be the next one due.
        offset: u32,
        /// The bytes; at least 1.
        data: Vec<u8, MAX_CHUNK>,
    },
    /// Asks how far the upload is, also after a restart of the device. Reply: [`Reply::Upload`].
    UploadQuery,
    /// All is sent: checks the table and takes it into use.
    UploadCommit,
    /// Gives the upload up.
    UploadAbort,
    /// A block of samples for the pipeline in place of the sensor's. Its reply comes when the block has gone
    /// through: reports, spectra and strobes that it makes are sent before.
    Feed(Feed),
    /// Edges that come before those of the next [`Feed`]; in the order of their time.
    FeedEdges(Vec<Edge, MAX_EDGES>),
    /// Forgets what the pipeline has learned and takes blocks from the sensor again.
    Reset,
    /// Tells the feed direction, from the machine's x towards its y, or that it is not known: for tables with layers for some.
    SetFeedDirection(Option<Degrees>),
    /// Asks for the feed direction, as told. Reply: [`Reply::FeedDirection`].
    FeedDirection,
}

impl Message for Request {
    const VARIANTS: u8 = 17;
}

/// What the device sends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // As for `Request`.
pub enum Response {
    /// The answer to a request.
    Reply {
        /// Sequence number of the request.
        request: u16,
        /// The answer.
        reply: Reply,
    },
    /// A frame could not be read, or was not the one that was due.
    FrameRefused(FrameError),
    /// What the pipeline says of a block.
    Report(Report),
    /// A piece of a spectrum.
    Spectrum(SpectrumChunk),
    /// Points of the stroboscopic map.
    Strobes(StrobeChunk),
}

impl Message for Response {
    const VARIANTS: u8 = 5;
}

/// The answer to a [`Request`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // As for `Request`.
pub enum Reply {
    /// It is done.
    Done,
    /// It is not done.
    Refused(Refusal),
    /// Who the device is.
    Info(Info),
    /// How the device is.
    Status(Status),
    /// The settings of the pipeline.
    Settings(Settings),
    /// How far the upload is.
    Upload(Upload),
    /// The feed direction, as told.
    FeedDirection(Option<Degrees>),
}

/// Why a request is not done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// [`Request::Hello`] must come first.
    HelloFirst,
    /// The settings cannot be.
    Settings(SettingsError),
    /// The working point cannot be: depth and feed must be numbers of at least 0, immersion from a smaller to a larger angle.
    WorkingPoint(WorkingPoint),
    /// The table, or its header, is none that this device can use.
    Table(TableError),
    /// The table does not fit a slot.
    TableTooLong {
        /// Its length in bytes.
        length: u32,
        /// The most bytes that fit.
        capacity: u32,
    },
    /// There is no upload to go on with.
    NoUpload,
    /// The chunk is not the next one due, or goes beyond the end of the table.
    ChunkOffset {
        /// Offset that is due.
        expected: u32,
        /// Offset of the chunk.
        found: u32,
        /// Length of the table.
        length: u32,
    },
    /// Not all of the table has been sent.
    Incomplete {
        /// Bytes received.
        received: u32,
        /// Length of the table.
        length: u32,
    },
    /// The flash memory does not take or keep the bytes.
    Flash,
    /// More edges than the device can hold for one block.
    TooManyEdges {
        /// The most it can hold.
        limit: u16,
    },
    /// The feed direction is no angle from −360 to 360 degrees.
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

/// Who a device is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// Version of the protocol.
    pub protocol: u8,
    /// Name of the board.
    pub board: String<24>,
    /// Version of the firmware.
    pub firmware: String<16>,
    /// The accelerometer of the board; `None` where it has none and is fed.
    pub sensor: Option<Sensor>,
    /// The most bytes of a table.
    pub slot_capacity: u32,
    /// The slots for tables.
    pub slots: [Slot; SLOTS],
    /// The table in use.
    pub table: Option<TableSummary>,
}

/// What is in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Slot {
    /// Nothing.
    Empty,
    /// A part of a table.
    Unfinished(Upload),
    /// Bytes that are no table.
    Damaged(TableError),
    /// A table.
    Valid(Header),
    /// The table in use.
    InUse(Header),
}

/// A table in a few words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableSummary {
    /// Name of its case.
    pub name: String<NAME_CAPACITY>,
    /// Number of teeth of the tool.
    pub teeth: u8,
    /// Limits of the machine, where the case has them.
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

/// How a device is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Time since the start.
    pub uptime: Nanoseconds,
    /// Blocks that went through the pipeline since the start.
    pub blocks: u32,
    /// Samples clipped since the pipeline was set up or reset.
    pub clipped: u32,
    /// Samples lost since then.
    pub lost: u32,
    /// True where the host feeds the pipeline, false where the sensor does.
    pub is_fed: bool,
    /// The working point, as told.
    pub working_point: Option<WorkingPoint>,
    /// What is sent without being asked.
    pub subscription: Subscription,
    /// Frames received.
    pub frames: u32,
    /// Frames that could not be used.
    pub frame_errors: FrameErrors,
    /// Reports, spectra and strobes that were not sent because the line is too slow.
    pub dropped: u32,
}

/// Which reports are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reports {
    /// None.
    #[default]
    None,
    /// Where verdict, reason or advice differ from the report before.
    Changes,
    /// All.
    All,
}

/// What the device sends without being asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Subscription {
    /// Reports.
    pub reports: Reports,
    /// Spectra, each when it is new.
    pub spectra: bool,
    /// Points of the stroboscopic map.
    pub strobes: bool,
}

/// How far an upload is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Upload {
    /// Header of the file.
    pub header: Header,
    /// Bytes received from the start of the file, its header included: the offset of the next chunk.
    pub received: u32,
}

/// A block of samples from the host.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Feed {
    sequence: u32,
    time: Nanoseconds,
    lost: u32,
    clipped: u16,
    /// Six bytes each, little-endian: a block of loud samples fits a frame just as one of quiet ones.
    counts: Vec<[u8; 6], MAX_BLOCK_SAMPLES>,
    /// Edges up to the end of the block, behind those of [`Request::FeedEdges`].
    pub edges: Vec<Edge, MAX_FEED_EDGES>,
}

impl Feed {
    /// The message that carries this block and these edges.
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

/// A piece of a spectrum. The pieces of one spectrum come in order, without another one between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectrumChunk {
    /// The band.
    pub band: Band,
    /// Sequence number of the block that completed the spectrum.
    pub sequence: u32,
    /// Width of a bin.
    pub bin: Hertz,
    /// Number of bins of the whole spectrum.
    pub bins: u16,
    /// Number of the first bin in this piece.
    pub first: u16,
    /// Power per bin, in (m/s²)².
    pub power: Vec<f32, MAX_CHUNK_BINS>,
}

/// Points of the stroboscopic map that one block made, or a part of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrobeChunk {
    /// Sequence number of the block.
    pub sequence: u32,
    /// The points, oldest first.
    pub strobes: Vec<Strobe, MAX_CHUNK_STROBES>,
}
