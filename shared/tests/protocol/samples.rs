//! One message of every variant, with every field set, and their frames.

use heapless::Vec as Heapless;
use quietcut_core::acceleration::{Block, Sensor};
use quietcut_core::advice::{Action, Advice, Obstacle, Source};
use quietcut_core::checksum::crc32;
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{Header, NotKnown, TableError};
use quietcut_core::monitor::{Band, Report, Settings, SettingsError, Strobe};
use quietcut_core::protocol::frame::Message;
use quietcut_core::protocol::{
    Decoder, Feed, FrameError, FrameErrors, Info, MAX_FRAME, Refusal, Reply, Reports, Request, Response,
    Slot, SpectrumChunk, Status, StrobeChunk, Subscription, TableSummary, Upload, encode,
};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Nanoseconds, Rpm};
use quietcut_core::working_point::{Limits, Tool, WorkingPoint};

/// The sequence number of the frozen frames.
pub(crate) const SEQUENCE: u16 = 0x0A00;

pub(crate) const HEADER: Header = Header {
    schema: 1,
    length: 70_000,
    generation: 0,
    crc: 0x1234_ABCD,
};
pub(crate) const LIMITS: Limits = Limits {
    rpm_min: Rpm(600.0),
    rpm_max: Rpm(2400.0),
};
pub(crate) const WORKING_POINT: WorkingPoint = WorkingPoint {
    axial_depth: Millimeters(2.0),
    start: Degrees(90.0),
    exit: Degrees(180.0),
    feed_per_tooth: Millimeters(0.15),
    posture: 1,
};
pub(crate) const SETTINGS: Settings = Settings {
    sensor: Sensor::IIS3DWB_16G,
    tool: Tool { teeth: 2 },
    wheel: Some(Wheel {
        positions: 60,
        missing: 2,
    }),
    assumed_speed: Some(Rpm(900.0)),
    limits: Some(LIMITS),
};
pub(crate) const SUBSCRIPTION: Subscription = Subscription {
    reports: Reports::All,
    spectra: true,
    strobes: false,
};
pub(crate) const UPLOAD: Upload = Upload {
    header: HEADER,
    received: 4096,
};
pub(crate) const FRAME_ERRORS: FrameErrors = FrameErrors {
    too_long: 1,
    cobs: 2,
    too_short: 3,
    crc: 4,
    version: 5,
    unknown_message: 6,
    body: 7,
    trailing_bytes: 8,
    out_of_order: 300,
};

pub(crate) fn edges<const N: usize>(count: u64) -> Heapless<Edge, N> {
    (1..=count)
        .map(|k| Edge {
            time: Nanoseconds(u64::MAX - k),
        })
        .collect()
}

/// The largest possible block: full, with extreme counts and the latest time.
pub(crate) fn block() -> Block {
    Block {
        sequence: u32::MAX,
        time: Nanoseconds(u64::MAX),
        lost: u32::MAX,
        clipped: u16::MAX,
        counts: (0..64_i16).map(|k| [i16::MIN + k, i16::MAX - k, -k]).collect(),
    }
}

pub(crate) fn report() -> Report {
    Report {
        sequence: 3,
        time: Nanoseconds(1_250_000_000),
        speed: Some(Rpm(900.1)),
        judgement: Judgement {
            verdict: Verdict::Hopf,
            reason: Reason::Growing,
            chatter: Some(Hertz(17.44)),
            multiplier_abs: Some(1.02),
            confidence: 0.98,
        },
        alarm: false,
        advice: Some(Advice {
            action: Action::Speed,
            speed: Rpm(1480.0),
            depth: Some(Millimeters(2.0)),
            source: Source::ToothPassingRule,
            assumed: Some(WORKING_POINT),
            obstacle: Some(Obstacle::Table(NotKnown::Speed {
                asked: Rpm(900.1),
                from: Rpm(1000.0),
                to: Rpm(2400.0),
            })),
        }),
        clipped: 4,
        lost: 5,
    }
}

pub(crate) fn info() -> Info {
    Info {
        protocol: 1,
        board: "nucleo-g474re".try_into().unwrap(),
        firmware: "0.1.0".try_into().unwrap(),
        sensor: Some(Sensor::IIS3DWB_16G),
        slot_capacity: 126_976,
        slots: [Slot::InUse(HEADER), Slot::Unfinished(UPLOAD)],
        table: Some(TableSummary {
            name: "kuka-kr90-acetal".try_into().unwrap(),
            teeth: 2,
            limits: Some(LIMITS),
            speeds: 600,
            speed_from: Rpm(600.0),
            speed_to: Rpm(2400.0),
            depth_from: Millimeters(0.0),
            depth_to: Millimeters(6.0),
            layers: 6,
        }),
    }
}

pub(crate) fn status() -> Status {
    Status {
        uptime: Nanoseconds(5_000_000_000),
        blocks: 1000,
        clipped: 7,
        lost: 8,
        is_fed: true,
        working_point: Some(WORKING_POINT),
        subscription: SUBSCRIPTION,
        frames: 77,
        frame_errors: FRAME_ERRORS,
        dropped: 9,
    }
}

pub(crate) fn requests() -> Vec<Request> {
    vec![
        Request::Hello,
        Request::Info,
        Request::Status,
        Request::Settings,
        Request::SetSettings(SETTINGS),
        Request::SetWorkingPoint(Some(WORKING_POINT)),
        Request::Subscribe(SUBSCRIPTION),
        Request::UploadBegin(HEADER),
        Request::UploadChunk {
            offset: 4096,
            data: (0..=255).collect(),
        },
        Request::UploadQuery,
        Request::UploadCommit,
        Request::UploadAbort,
        Request::Feed(Feed::new(&block(), edges(8))),
        Request::FeedEdges(edges(32)),
        Request::Reset,
        Request::SetFeedDirection(Some(Degrees(-30.5))),
        Request::FeedDirection,
    ]
}

pub(crate) fn frame_errors() -> Vec<FrameError> {
    vec![
        FrameError::TooLong { limit: 519 },
        FrameError::Cobs,
        FrameError::TooShort { found: 7 },
        FrameError::Crc {
            frame: 0x1234_ABCD,
            computed: 0xABCD_1234,
        },
        FrameError::Version { ours: 1, theirs: 2 },
        FrameError::UnknownMessage { variant: 99 },
        FrameError::Body { variant: 4 },
        FrameError::TrailingBytes { count: 300 },
        FrameError::OutOfOrder {
            expected: 7,
            found: 300,
        },
    ]
}

pub(crate) fn refusals() -> Vec<Refusal> {
    vec![
        Refusal::HelloFirst,
        Refusal::Settings(SettingsError::Teeth(0)),
        Refusal::WorkingPoint(WORKING_POINT),
        Refusal::Table(TableError::Crc {
            header: 1,
            computed: 2,
        }),
        Refusal::TableTooLong {
            length: 200_000,
            capacity: 126_976,
        },
        Refusal::NoUpload,
        Refusal::ChunkOffset {
            expected: 256,
            found: 512,
            length: 70_000,
        },
        Refusal::Incomplete {
            received: 4096,
            length: 70_000,
        },
        Refusal::Flash,
        Refusal::TooManyEdges { limit: 128 },
        Refusal::FeedDirection(Degrees(400.0)),
    ]
}

pub(crate) fn replies() -> Vec<Reply> {
    let mut replies = vec![
        Reply::Done,
        Reply::Info(info()),
        Reply::Status(status()),
        Reply::Settings(SETTINGS),
        Reply::Upload(UPLOAD),
        Reply::FeedDirection(Some(Degrees(-30.5))),
    ];
    replies.extend(refusals().into_iter().map(Reply::Refused));
    replies
}

pub(crate) fn responses() -> Vec<Response> {
    let strobe = |tooth| Strobe {
        band: Band::Structure,
        tooth,
        meters_per_second2: [0.5, -0.25, 9.75],
    };
    let mut responses = vec![
        Response::Report(report()),
        Response::Spectrum(SpectrumChunk {
            band: Band::Tool,
            sequence: u32::MAX,
            bin: Hertz(13.02),
            bins: 513,
            first: 480,
            power: (0..96_u8).map(|k| 1.0 / f32::from(k + 1)).collect(),
        }),
        Response::Strobes(StrobeChunk {
            sequence: u32::MAX,
            strobes: (0..16).map(|k| strobe(u32::MAX - k)).collect(),
        }),
    ];
    responses.extend(replies().into_iter().map(|reply| Response::Reply {
        request: 0xFFFF,
        reply,
    }));
    responses.extend(frame_errors().into_iter().map(Response::FrameRefused));
    responses
}

// The matches below have no `_`. A new variant does not compile until it has a name, and then needs a frozen frame.

pub(crate) fn request_name(request: &Request) -> String {
    match request {
        Request::Hello => "hello",
        Request::Info => "info",
        Request::Status => "status",
        Request::Settings => "settings",
        Request::SetSettings(_) => "set-settings",
        Request::SetWorkingPoint(_) => "set-working-point",
        Request::Subscribe(_) => "subscribe",
        Request::UploadBegin(_) => "upload-begin",
        Request::UploadChunk { .. } => "upload-chunk",
        Request::UploadQuery => "upload-query",
        Request::UploadCommit => "upload-commit",
        Request::UploadAbort => "upload-abort",
        Request::Feed(_) => "feed",
        Request::FeedEdges(_) => "feed-edges",
        Request::Reset => "reset",
        Request::SetFeedDirection(_) => "set-feed-direction",
        Request::FeedDirection => "feed-direction",
    }
    .into()
}

pub(crate) fn response_name(response: &Response) -> String {
    match response {
        Response::Reply { reply, .. } => match reply {
            Reply::Done => "reply-done".into(),
            Reply::Info(_) => "reply-info".into(),
            Reply::Status(_) => "reply-status".into(),
            Reply::Settings(_) => "reply-settings".into(),
            Reply::Upload(_) => "reply-upload".into(),
            Reply::FeedDirection(_) => "reply-feed-direction".into(),
            Reply::Refused(refusal) => format!("refused-{}", refusal_name(refusal)),
        },
        Response::FrameRefused(error) => format!("frame-{}", frame_error_name(error)),
        Response::Report(_) => "report".into(),
        Response::Spectrum(_) => "spectrum".into(),
        Response::Strobes(_) => "strobes".into(),
    }
}

pub(crate) fn refusal_name(refusal: &Refusal) -> &'static str {
    match refusal {
        Refusal::HelloFirst => "hello-first",
        Refusal::Settings(_) => "settings",
        Refusal::WorkingPoint(_) => "working-point",
        Refusal::Table(_) => "table",
        Refusal::TableTooLong { .. } => "table-too-long",
        Refusal::NoUpload => "no-upload",
        Refusal::ChunkOffset { .. } => "chunk-offset",
        Refusal::Incomplete { .. } => "incomplete",
        Refusal::Flash => "flash",
        Refusal::TooManyEdges { .. } => "too-many-edges",
        Refusal::FeedDirection(_) => "feed-direction",
    }
}

pub(crate) fn frame_error_name(error: &FrameError) -> &'static str {
    match error {
        FrameError::TooLong { .. } => "too-long",
        FrameError::Cobs => "cobs",
        FrameError::TooShort { .. } => "too-short",
        FrameError::Crc { .. } => "crc",
        FrameError::Version { .. } => "version",
        FrameError::UnknownMessage { .. } => "unknown-message",
        FrameError::Body { .. } => "body",
        FrameError::TrailingBytes { .. } => "trailing-bytes",
        FrameError::OutOfOrder { .. } => "out-of-order",
    }
}

pub(crate) fn frame_of<M: Message>(message: &M) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(message, SEQUENCE, &mut buffer).unwrap().to_vec()
}

/// A frame with this content before the CRC, valid or not.
pub(crate) fn forged(content: &[u8]) -> Vec<u8> {
    let raw = [content, &crc32([content]).to_le_bytes()].concat();
    let mut buffer = vec![0; cobs::max_encoding_length(raw.len()) + 1];
    let length = cobs::encode(&raw, &mut buffer);
    buffer.truncate(length + 1);
    buffer
}

pub(crate) type Decoded<M> = Result<(u16, M), FrameError>;

pub(crate) fn decode_all<M: Message>(bytes: &[u8]) -> Vec<Decoded<M>> {
    let mut decoder = Decoder::new();
    let mut found = Vec::new();
    for &byte in bytes {
        if let Some(result) = decoder.push(byte) {
            found.push(result.and_then(|frame| Ok((frame.sequence, frame.message()?))));
        }
    }
    found
}
