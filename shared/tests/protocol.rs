//! The protocol: frozen bytes, errors that can be told apart, streams with noise in them.
#![allow(clippy::unwrap_used, clippy::panic)]

use heapless::Vec as Heapless;
use proptest::prelude::*;
use quietcut_core::acceleration::{Block, Sensor};
use quietcut_core::advice::{Action, Advice, Obstacle, Source};
use quietcut_core::checksum::crc32;
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{Header, NotKnown, TableError};
use quietcut_core::monitor::{Band, Report, Settings, SettingsError, Strobe};
use quietcut_core::protocol::frame::{MAX_BODY, Message, TooLarge};
use quietcut_core::protocol::message::MAX_CHUNK;
use quietcut_core::protocol::{
    Decoder, Feed, FrameError, FrameErrors, Info, MAX_FRAME, Refusal, Reply, Reports, Request, Response,
    Sequence, Slot, SpectrumChunk, Status, StrobeChunk, Subscription, TableSummary, Upload, VERSION, encode,
};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Nanoseconds, Rpm};
use quietcut_core::working_point::{Limits, Tool, WorkingPoint};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Frames of version 1, one per line: name, bytes in hexadecimal. They never change.
const FROZEN_V1: &str = include_str!("protocol_v1.txt");

/// The sequence number of the frozen frames.
const SEQUENCE: u16 = 0x0A00;

const HEADER: Header = Header {
    schema: 1,
    length: 70_000,
    generation: 0,
    crc: 0x1234_ABCD,
};
const LIMITS: Limits = Limits {
    rpm_min: Rpm(600.0),
    rpm_max: Rpm(2400.0),
};
const WORKING_POINT: WorkingPoint = WorkingPoint {
    axial_depth: Millimeters(2.0),
    start: Degrees(90.0),
    exit: Degrees(180.0),
    feed_per_tooth: Millimeters(0.15),
    posture: 1,
};
const SETTINGS: Settings = Settings {
    sensor: Sensor::IIS3DWB_16G,
    tool: Tool { teeth: 2 },
    wheel: Some(Wheel {
        positions: 60,
        missing: 2,
    }),
    assumed_speed: Some(Rpm(900.0)),
    limits: Some(LIMITS),
};
const SUBSCRIPTION: Subscription = Subscription {
    reports: Reports::All,
    spectra: true,
    strobes: false,
};
const UPLOAD: Upload = Upload {
    header: HEADER,
    received: 4096,
};
const FRAME_ERRORS: FrameErrors = FrameErrors {
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

fn edges<const N: usize>(count: u64) -> Heapless<Edge, N> {
    (1..=count)
        .map(|k| Edge {
            time: Nanoseconds(u64::MAX - k),
        })
        .collect()
}

/// As large as a block can be: full, loud, late.
fn block() -> Block {
    Block {
        sequence: u32::MAX,
        time: Nanoseconds(u64::MAX),
        lost: u32::MAX,
        clipped: u16::MAX,
        counts: (0..64_i16).map(|k| [i16::MIN + k, i16::MAX - k, -k]).collect(),
    }
}

fn report() -> Report {
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

fn info() -> Info {
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

fn status() -> Status {
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

fn requests() -> Vec<Request> {
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

fn frame_errors() -> Vec<FrameError> {
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

fn refusals() -> Vec<Refusal> {
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

fn replies() -> Vec<Reply> {
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

fn responses() -> Vec<Response> {
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

// The matches below have no `_`: a new variant does not compile until it has a name, and then a frozen frame.

fn request_name(request: &Request) -> String {
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

fn response_name(response: &Response) -> String {
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

fn refusal_name(refusal: &Refusal) -> &'static str {
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

fn frame_error_name(error: &FrameError) -> &'static str {
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

fn frame_of<M: Message>(message: &M) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(message, SEQUENCE, &mut buffer).unwrap().to_vec()
}

/// A frame with this content before the CRC, whatever it is.
fn forged(content: &[u8]) -> Vec<u8> {
    let raw = [content, &crc32([content]).to_le_bytes()].concat();
    let mut buffer = vec![0; cobs::max_encoding_length(raw.len()) + 1];
    let length = cobs::encode(&raw, &mut buffer);
    buffer.truncate(length + 1);
    buffer
}

type Decoded<M> = Result<(u16, M), FrameError>;

fn decode_all<M: Message>(bytes: &[u8]) -> Vec<Decoded<M>> {
    let mut decoder = Decoder::new();
    let mut found = Vec::new();
    for &byte in bytes {
        if let Some(result) = decoder.push(byte) {
            found.push(result.and_then(|frame| Ok((frame.sequence, frame.message()?))));
        }
    }
    found
}

fn line(name: &str, bytes: &[u8]) -> String {
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{name} {hex}")
}

#[test]
fn the_bytes_of_version_1_are_frozen() {
    assert_eq!(
        VERSION, 1,
        "a new version needs its own frozen bytes beside these"
    );
    let now: Vec<String> = requests()
        .iter()
        .map(|request| line(&request_name(request), &frame_of(request)))
        .chain(
            responses()
                .iter()
                .map(|response| line(&response_name(response), &frame_of(response))),
        )
        .collect();
    let frozen: Vec<&str> = FROZEN_V1.lines().filter(|line| !line.starts_with('#')).collect();
    if now != frozen {
        println!("{}", now.join("\n"));
    }
    for (now, frozen) in now.iter().zip(&frozen) {
        assert_eq!(now, frozen);
    }
    assert_eq!(now.len(), frozen.len());
}

#[test]
fn every_variant_has_a_frozen_frame() {
    let firsts = |frames: Vec<u8>| {
        let mut firsts = frames;
        firsts.sort_unstable();
        firsts.dedup();
        firsts
    };
    // Behind COBS, version and sequence stands the number of the variant.
    let variant = |frame: Vec<u8>| {
        let mut raw = [0; MAX_FRAME];
        cobs::decode(&frame, &mut raw).unwrap();
        raw[3]
    };
    let sent = firsts(requests().iter().map(frame_of).map(variant).collect());
    assert_eq!(sent, (0..Request::VARIANTS).collect::<Vec<_>>());
    let sent = firsts(responses().iter().map(frame_of).map(variant).collect());
    assert_eq!(sent, (0..Response::VARIANTS).collect::<Vec<_>>());
}

#[test]
fn messages_come_back() {
    for request in requests() {
        assert_eq!(decode_all(&frame_of(&request)), [Ok((SEQUENCE, request))]);
    }
    for response in responses() {
        assert_eq!(decode_all(&frame_of(&response)), [Ok((SEQUENCE, response))]);
    }
    let Request::Feed(feed) = &requests()[12] else {
        panic!("a feed")
    };
    assert_eq!(feed.block(), block());
}

#[test]
fn the_largest_message_of_each_kind_fits_a_frame() {
    let longest = |frames: Vec<usize>| frames.into_iter().max().unwrap();
    let request = longest(requests().iter().map(|request| frame_of(request).len()).collect());
    let response = longest(
        responses()
            .iter()
            .map(|response| frame_of(response).len())
            .collect(),
    );
    assert!(
        request <= MAX_FRAME && response <= MAX_FRAME,
        "{request} {response}"
    );
    // The largest names and numbers that an `Info` can have.
    let long = |length| "x".repeat(length);
    let info = Info {
        protocol: u8::MAX,
        board: long(24).as_str().try_into().unwrap(),
        firmware: long(16).as_str().try_into().unwrap(),
        slot_capacity: u32::MAX,
        slots: [Slot::Unfinished(Upload {
            header: Header {
                schema: u16::MAX,
                length: u32::MAX,
                generation: u32::MAX,
                crc: u32::MAX,
            },
            received: u32::MAX,
        }); 2],
        table: info().table.map(|table| TableSummary {
            name: long(32).as_str().try_into().unwrap(),
            ..table
        }),
        ..info()
    };
    let frame = frame_of(&Response::Reply {
        request: u16::MAX,
        reply: Reply::Info(info),
    });
    assert!(frame.len() <= MAX_FRAME);
}

#[test]
fn what_does_not_fit_is_refused() {
    #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    struct Large(Heapless<u8, 600>);
    impl Message for Large {
        const VARIANTS: u8 = 255;
    }
    let large = |byte, length| Large(core::iter::repeat_n(byte, length).collect());
    let mut buffer = [0; MAX_FRAME];
    // Two bytes of length before the content.
    assert_eq!(encode(&large(7, MAX_BODY - 1), 0, &mut buffer), Err(TooLarge));
    let largest = large(7, MAX_BODY - 2);
    let frame = encode(&largest, 0, &mut buffer).unwrap().to_vec();
    let zeros = large(0, MAX_BODY - 2);
    assert!(encode(&zeros, 0, &mut buffer).is_ok());
    let mut decoder = Decoder::new();
    let errors: Vec<FrameError> = frame
        .iter()
        .filter_map(|&byte| decoder.push(byte)?.err())
        .collect();
    assert_eq!(errors, []);
}

#[test]
fn each_damage_has_its_own_error() {
    let frame = frame_of(&Request::SetSettings(SETTINGS));
    let error = |bytes: &[u8]| {
        let results = decode_all::<Request>(bytes);
        assert_eq!(results.len(), 1);
        results.into_iter().find_map(Result::err).unwrap()
    };
    let raw = |body: &[u8]| [&[VERSION, 0, 0], body].concat();

    // Cut off in the middle: the zero comes too soon.
    assert_eq!(error(&[&frame[..20], &[0]].concat()), FrameError::Cobs);
    assert_eq!(error(&[1, 2, 0]), FrameError::Cobs);
    assert_eq!(error(&[4, 1, 2, 3, 0]), FrameError::TooShort { found: 3 });
    assert_eq!(
        error(&forged(&[VERSION, 0, 0])),
        FrameError::TooShort { found: 7 }
    );
    assert_eq!(
        error(&[&[1; 600], [0].as_slice()].concat()),
        FrameError::TooLong { limit: 519 }
    );
    let mut flipped = frame.clone();
    flipped[7] ^= 0x10;
    let FrameError::Crc {
        frame: said,
        computed,
    } = error(&flipped)
    else {
        panic!("a CRC error")
    };
    assert_ne!(said, computed);
    assert_eq!(
        error(&forged(&[2, 0, 0, 0])),
        FrameError::Version { ours: 1, theirs: 2 }
    );
    assert_eq!(
        error(&forged(&raw(&[17]))),
        FrameError::UnknownMessage { variant: 17 }
    );
    assert_eq!(
        error(&forged(&raw(&[0xFF]))),
        FrameError::UnknownMessage { variant: 255 }
    );
    assert_eq!(error(&forged(&raw(&[4, 1, 2]))), FrameError::Body { variant: 4 });
    assert_eq!(
        error(&forged(&raw(&[0, 1, 2]))),
        FrameError::TrailingBytes { count: 2 }
    );
    // A chunk that claims more bytes than one can have.
    let chunk = [8, 0, (MAX_CHUNK + 1) as u8 | 0x80, 2];
    assert_eq!(
        error(&forged(&raw(&[chunk.as_slice(), &[0; 300]].concat()))),
        FrameError::Body { variant: 8 }
    );

    // Whatever happened, the next frame is read.
    for noise in [
        &frame[..20],
        &[1, 2],
        &[4, 1, 2, 3],
        &[1; 600],
        &flipped[..flipped.len() - 1],
        &[0, 0, 0],
    ] {
        let bytes = [noise, &[0], &frame].concat();
        assert_eq!(
            decode_all(&bytes).last(),
            Some(&Ok((SEQUENCE, Request::SetSettings(SETTINGS))))
        );
    }
}

#[test]
fn errors_are_counted_by_kind() {
    let mut counts = FrameErrors::default();
    for (times, error) in frame_errors().iter().enumerate() {
        for _ in 0..=times {
            counts.count(error);
        }
    }
    assert_eq!(counts.total(), 45);
    assert_eq!(
        FrameErrors {
            out_of_order: 9,
            ..FRAME_ERRORS
        },
        counts
    );
}

#[test]
fn no_flipped_bit_becomes_a_message() {
    let mut flips = 0;
    let mut check = |frame: Vec<u8>, is_message: fn(&[u8]) -> bool| {
        for bit in 0..8 * frame.len() {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            damaged.push(0);
            assert!(!is_message(&damaged), "bit {bit} of {frame:02x?}");
            flips += 1;
        }
    };
    for request in requests() {
        check(frame_of(&request), |bytes| {
            decode_all::<Request>(bytes).iter().any(Result::is_ok)
        });
    }
    for response in responses() {
        check(frame_of(&response), |bytes| {
            decode_all::<Response>(bytes).iter().any(Result::is_ok)
        });
    }
    assert!(flips > 20_000, "{flips}");
}

#[test]
fn sequence_numbers_go_round() {
    let mut sent = Sequence::default();
    assert_eq!((sent.take(), sent.take()), (0, 1));
    let mut sent = Sequence::from(u16::MAX);
    assert_eq!((sent.take(), sent.take()), (u16::MAX, 0));

    let mut received = Sequence::default();
    assert_eq!(received.check(65_534), Ok(()));
    assert_eq!(received.check(65_535), Ok(()));
    assert_eq!(received.check(0), Ok(()));
    let out_of_order = |found| Err(FrameError::OutOfOrder { expected: 1, found });
    assert_eq!(received.check(0), out_of_order(0));
    assert_eq!(received.check(5), out_of_order(5));
    assert_eq!(received.check(1), Ok(()));
    received.restart_after(99);
    assert_eq!(received.check(100), Ok(()));
}

#[test]
fn a_stream_with_every_kind_of_damage() {
    const SEED: u64 = 20_240_611;
    println!("seed {SEED}");
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let frames: Vec<Vec<u8>> = requests().iter().map(frame_of).collect();
    let mut decoder = Decoder::new();
    let (mut good, mut bad) = (0_u32, 0_u32);
    for _ in 0..20_000 {
        let mut bytes = frames[random.random_range(0..frames.len())].clone();
        for _ in 0..random.random_range(0..3) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..5) {
                0 => bytes[at] ^= 1 << random.random_range(0..8),
                1 => bytes[at] = random.random(),
                2 => bytes.insert(at, random.random()),
                3 => bytes.truncate(at.max(1)),
                _ => bytes.extend_from_within(at..),
            }
        }
        for byte in bytes {
            match decoder
                .push(byte)
                .map(|result| result.and_then(|frame| frame.message::<Request>()))
            {
                // Nothing but what was sent may come out.
                Some(Ok(message)) => {
                    assert!(requests().contains(&message));
                    good += 1;
                }
                Some(Err(_)) => bad += 1,
                None => {}
            }
        }
    }
    assert!(good > 5_000 && bad > 5_000, "{good} {bad}");
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic_and_the_frame_behind_them_is_read(
        noise in prop::collection::vec(any::<u8>(), 0..1500), which in 0_usize..15, zeros in any::<bool>(),
    ) {
        // Half of the noise with few zeros, so that long frames and long bodies are tried too.
        let noise: Vec<u8> = noise.into_iter().map(|byte| if zeros { byte } else { byte.max(1) }).collect();
        let request = requests().remove(which);
        let bytes = [noise, vec![0], frame_of(&request)].concat();
        let decoded = decode_all(&bytes);
        prop_assert_eq!(decoded.last(), Some(&Ok((SEQUENCE, request))));
    }

    #[test]
    fn no_body_makes_it_panic(body in prop::collection::vec(any::<u8>(), 1..500)) {
        let frame = forged(&[[VERSION, 0, 0].as_slice(), &body].concat());
        let _ = decode_all::<Request>(&frame);
        let _ = decode_all::<Response>(&frame);
    }

    #[test]
    fn blocks_come_back(
        counts in prop::collection::vec(any::<[i16; 3]>(), 0..=64), sequence: u32, time: u64, lost: u32, clipped: u16,
    ) {
        let block = Block { sequence, time: Nanoseconds(time), lost, clipped, counts: counts.into_iter().collect() };
        let request = Request::Feed(Feed::new(&block, edges(3)));
        let [Ok((_, Request::Feed(feed)))] = &decode_all(&frame_of(&request))[..] else { panic!("a feed") };
        prop_assert_eq!(feed.block(), block);
        prop_assert_eq!(feed.edges.len(), 3);
    }
}
