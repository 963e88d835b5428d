//! The device behind a line: requests, retries, uploads, feeding, slow and noisy lines.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::cell::Cell;
use std::rc::Rc;

use proptest::prelude::*;
use quietcut_core::acceleration::Sensor;
use quietcut_core::checksum::crc32;
use quietcut_core::lobes::{Header, LobeTable, TableError};
use quietcut_core::monitor::{Band, Monitor, Report, Settings, SettingsError, State, Strobe};
use quietcut_core::protocol::message::{MAX_CHUNK, MAX_FEED_EDGES};
use quietcut_core::protocol::{
    Feed, FrameError, Info, Refusal, Reply, Reports, Request, Response, Slot, SpectrumChunk, Status,
    Subscription, Upload, VERSION,
};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::{Degrees, Millimeters, Nanoseconds};
use quietcut_core::working_point::{Tool, WorkingPoint};
use quietcut_firmware::device::{Clock, Device, Identity};
use quietcut_firmware::flash_model::FlashModel;
use support::{Host, SETTINGS, Wire, blocks, frame, refused_frame, table};

type Flash = FlashModel<Vec<u8>, 8, 2048>;

const IDENTITY: Identity = Identity {
    board: "test",
    sensor: Some(Sensor::IIS3DWB_16G),
};
const ALL: Subscription = Subscription {
    reports: Reports::All,
    spectra: true,
    strobes: true,
};
const POINT: WorkingPoint = WorkingPoint {
    axial_depth: Millimeters(2.0),
    start: Degrees(90.0),
    exit: Degrees(180.0),
    feed_per_tooth: Millimeters(0.15),
    posture: 0,
};

fn flash() -> Flash {
    Flash::new(vec![0xFF; 32 * 2048])
}

/// A clock that a test sets.
#[derive(Clone, Default)]
struct TestClock(Rc<Cell<u64>>);

impl Clock for TestClock {
    fn now(&self) -> Nanoseconds {
        Nanoseconds(self.0.get())
    }
}

/// A device with its line and its host.
struct Bench<'a> {
    device: Device<'a, Flash, TestClock>,
    clock: TestClock,
    wire: Wire,
    host: Host,
}

impl<'a> Bench<'a> {
    fn new(state: &'a mut State, flash: Flash) -> Self {
        let clock = TestClock::default();
        let device = Device::new(IDENTITY, SETTINGS, state, flash, clock.clone()).unwrap();
        Self {
            device,
            clock,
            wire: Wire::default(),
            host: Host::default(),
        }
    }

    /// With a session begun.
    fn open(state: &'a mut State, flash: Flash) -> Self {
        let mut bench = Self::new(state, flash);
        assert!(matches!(bench.ask(Request::Hello), Reply::Info(_)));
        bench
    }

    fn exchange(&mut self, bytes: &[u8]) -> Vec<Response> {
        self.wire.to_device.extend(bytes);
        while self.device.poll(&mut self.wire).unwrap() {}
        self.host.hear(&mut self.wire)
    }

    /// All that comes in answer to a request; the reply must be the last.
    fn ask_all(&mut self, request: &Request) -> (Vec<Response>, Reply) {
        let (sequence, frame) = self.host.frame(request);
        let mut responses = self.exchange(&frame);
        match responses.pop() {
            Some(Response::Reply { request, reply }) if request == sequence => (responses, reply),
            other => panic!("{other:?} for {request:?}"),
        }
    }

    fn ask(&mut self, request: Request) -> Reply {
        let (others, reply) = self.ask_all(&request);
        assert_eq!(others, []);
        reply
    }

    fn info(&mut self) -> Info {
        match self.ask(Request::Info) {
            Reply::Info(info) => info,
            other => panic!("{other:?}"),
        }
    }

    fn status(&mut self) -> Status {
        match self.ask(Request::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    /// Sends what is left of a table, up to `until` bytes of it.
    fn send(&mut self, file: &[u8], until: usize) -> Upload {
        let Reply::Upload(mut upload) = self.ask(Request::UploadBegin(Header::read(file).unwrap())) else {
            panic!("an upload")
        };
        while (upload.received as usize) < until {
            let from = upload.received as usize;
            let to = (from + MAX_CHUNK).min(until);
            let data = file[from..to].iter().copied().collect();
            match self.ask(Request::UploadChunk {
                offset: upload.received,
                data,
            }) {
                Reply::Upload(now) => upload = now,
                other => panic!("{other:?}"),
            }
        }
        upload
    }

    fn upload(&mut self, file: &[u8]) {
        self.send(file, file.len());
        assert_eq!(self.ask(Request::UploadCommit), Reply::Done);
    }
}

/// What a pipeline says and shows, taken straight from it.
#[derive(Debug, Default, PartialEq)]
struct Heard {
    reports: Vec<Report>,
    strobes: Vec<(u32, Strobe)>,
    spectra: Vec<(Band, u32, u32, Vec<u32>)>,
}

impl Heard {
    fn take(&mut self, responses: Vec<Response>) {
        for response in responses {
            match response {
                Response::Report(report) => self.reports.push(report),
                Response::Strobes(chunk) => {
                    self.strobes
                        .extend(chunk.strobes.iter().map(|strobe| (chunk.sequence, *strobe)));
                }
                Response::Spectrum(chunk) => self.take_spectrum(&chunk),
                other => panic!("{other:?}"),
            }
        }
    }

    fn take_spectrum(&mut self, chunk: &SpectrumChunk) {
        if chunk.first == 0 {
            self.spectra
                .push((chunk.band, chunk.sequence, chunk.bin.0.to_bits(), Vec::new()));
        }
        let (band, sequence, bin, power) = self.spectra.last_mut().unwrap();
        assert_eq!(
            (*band, *sequence, *bin, power.len()),
            (
                chunk.band,
                chunk.sequence,
                chunk.bin.0.to_bits(),
                usize::from(chunk.first)
            )
        );
        power.extend(chunk.power.iter().map(|power| power.to_bits()));
    }
}

/// What the same blocks make of a pipeline without a device around it.
fn straight(blocks: &[(quietcut_core::acceleration::Block, Vec<Edge>)], table: Option<&LobeTable>) -> Heard {
    let monitor = Monitor::new(SETTINGS).unwrap();
    let mut state = State::default();
    let mut heard = Heard::default();
    for (block, edges) in blocks {
        heard
            .reports
            .push(monitor.step(&mut state, block, edges, table, Some(&POINT)));
        heard
            .strobes
            .extend(state.strobes().iter().map(|strobe| (block.sequence, *strobe)));
        for band in [Band::Structure, Band::Tool] {
            if !state.has_fresh_spectrum(band) {
                continue;
            }
            let spectrum = state.spectrum(band).unwrap();
            let power = spectrum.power.iter().map(|power| power.to_bits()).collect();
            heard
                .spectra
                .push((band, block.sequence, spectrum.bin.0.to_bits(), power));
        }
    }
    heard
}

fn feed(block: &quietcut_core::acceleration::Block, edges: &[Edge]) -> Request {
    assert!(edges.len() <= MAX_FEED_EDGES);
    Request::Feed(Feed::new(block, edges.iter().copied().collect()))
}

#[test]
fn a_session_begins_with_hello() {
    let mut state = State::default();
    let mut bench = Bench::new(&mut state, flash());
    assert_eq!(bench.ask(Request::Status), Reply::Refused(Refusal::HelloFirst));
    // Under any number, and the next ones follow it.
    bench.host.next = u16::MAX;
    let Reply::Info(info) = bench.ask(Request::Hello) else {
        panic!("an info")
    };
    assert_eq!(
        (info.protocol, info.board.as_str(), info.firmware.as_str()),
        (VERSION, "test", "0.1.0")
    );
    assert_eq!((info.sensor, info.table), (Some(Sensor::IIS3DWB_16G), None));
    assert_eq!((info.slots, info.slot_capacity), ([Slot::Empty; 2], 15 * 2048));
    bench.clock.0.set(5_000_000_000);
    let status = bench.status();
    assert_eq!(
        (status.uptime, status.frames, status.frame_errors.total()),
        (Nanoseconds(5_000_000_000), 3, 0)
    );
    // The device's own count has no gaps.
    assert_eq!(bench.host.heard, [0, 1, 2]);
}

#[test]
fn settings_and_working_point() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    assert_eq!(bench.ask(Request::Settings), Reply::Settings(SETTINGS));
    let settings = Settings {
        tool: Tool { teeth: 4 },
        ..SETTINGS
    };
    assert_eq!(bench.ask(Request::SetSettings(settings)), Reply::Done);
    assert_eq!(bench.ask(Request::Settings), Reply::Settings(settings));
    let toothless = Settings {
        tool: Tool { teeth: 0 },
        ..SETTINGS
    };
    let refusal = Refusal::Settings(SettingsError::Teeth(0));
    assert_eq!(
        bench.ask(Request::SetSettings(toothless)),
        Reply::Refused(refusal)
    );
    assert_eq!(bench.ask(Request::Settings), Reply::Settings(settings));

    assert_eq!(bench.ask(Request::SetWorkingPoint(Some(POINT))), Reply::Done);
    for wrong in [
        WorkingPoint {
            axial_depth: Millimeters(-1.0),
            ..POINT
        },
        WorkingPoint {
            feed_per_tooth: Millimeters(f32::INFINITY),
            ..POINT
        },
        WorkingPoint {
            exit: Degrees(90.0),
            ..POINT
        },
    ] {
        let reply = bench.ask(Request::SetWorkingPoint(Some(wrong)));
        assert_eq!(reply, Reply::Refused(Refusal::WorkingPoint(wrong)));
    }
    assert_eq!(bench.status().working_point, Some(POINT));
    assert_eq!(bench.ask(Request::SetWorkingPoint(None)), Reply::Done);
    assert_eq!(bench.status().working_point, None);

    let direction = Some(Degrees(-30.0));
    assert_eq!(bench.ask(Request::FeedDirection), Reply::FeedDirection(None));
    assert_eq!(bench.ask(Request::SetFeedDirection(direction)), Reply::Done);
    for wrong in [f32::INFINITY, 361.0] {
        let reply = bench.ask(Request::SetFeedDirection(Some(Degrees(wrong))));
        assert_eq!(reply, Reply::Refused(Refusal::FeedDirection(Degrees(wrong))));
    }
    assert_eq!(bench.ask(Request::FeedDirection), Reply::FeedDirection(direction));
    assert_eq!(bench.ask(Request::SetFeedDirection(None)), Reply::Done);
    assert_eq!(bench.ask(Request::FeedDirection), Reply::FeedDirection(None));
}

#[test]
fn a_table_is_uploaded_and_outlives_a_restart() {
    let file = table("acetal", 1.7, 181);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.upload(&file);
    let info = bench.info();
    let summary = info.table.unwrap();
    assert_eq!(
        (
            summary.name.as_str(),
            summary.teeth,
            summary.speeds,
            summary.layers
        ),
        ("acetal", 2, 181, 1)
    );
    assert_eq!(
        (summary.speed_from.0, summary.speed_to.0, summary.depth_to.0),
        (600.0, 2400.0, 6.0)
    );
    assert!(matches!(info.slots, [Slot::InUse(header), Slot::Empty] if header.generation == 1));

    let flash = Flash::new(bench.device.into_memory().into_bytes());
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash);
    assert_eq!(bench.info().table.unwrap().name, "acetal");
}

#[test]
fn an_upload_goes_on_after_a_restart() {
    let file = table("acetal", 1.7, 600);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.send(&file, 5000);
    let flash = Flash::new(bench.device.into_memory().into_bytes());

    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash);
    let header = Header::read(&file).unwrap();
    // Two pages of 2 048 bytes were full.
    assert_eq!(
        bench.ask(Request::UploadQuery),
        Reply::Upload(Upload {
            header,
            received: 4096
        })
    );
    assert!(matches!(bench.info().slots, [Slot::Unfinished(_), Slot::Empty]));
    let incomplete = Refusal::Incomplete {
        received: 4096,
        length: header.length,
    };
    assert_eq!(bench.ask(Request::UploadCommit), Reply::Refused(incomplete));
    bench.upload(&file);
    assert_eq!(bench.info().table.unwrap().name, "acetal");
}

#[test]
fn what_is_no_table_leaves_the_last_good_one() {
    let file = table("good", 1.7, 181);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    assert_eq!(bench.ask(Request::UploadQuery), Reply::Refused(Refusal::NoUpload));
    bench.upload(&file);

    let mut damaged = table("damaged", 1.7, 181);
    damaged[500] ^= 8;
    bench.send(&damaged, damaged.len());
    let reply = bench.ask(Request::UploadCommit);
    assert!(
        matches!(reply, Reply::Refused(Refusal::Table(TableError::Crc { .. }))),
        "{reply:?}"
    );

    let header = Header::read(&file).unwrap();
    let long = Header {
        length: 1_000_000,
        ..header
    };
    let refusal = Refusal::TableTooLong {
        length: 1_000_000,
        capacity: 15 * 2048,
    };
    assert_eq!(bench.ask(Request::UploadBegin(long)), Reply::Refused(refusal));

    bench.send(&table("given-up", 1.7, 181), 1000);
    let chunk = Request::UploadChunk {
        offset: 5000,
        data: [0; 10].into_iter().collect(),
    };
    let refusal = Refusal::ChunkOffset {
        expected: 1000,
        found: 5000,
        length: header.length,
    };
    assert_eq!(bench.ask(chunk), Reply::Refused(refusal));
    assert_eq!(bench.ask(Request::UploadAbort), Reply::Done);
    let info = bench.info();
    assert_eq!(info.table.unwrap().name, "good");
    assert_eq!(info.slots[1], Slot::Empty);
}

#[test]
fn a_request_that_comes_twice_is_done_once() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    for (block, edges) in &blocks(3) {
        let (sequence, frame) = bench.host.frame(&feed(block, edges));
        // As if the replies to the first two were lost.
        let replies: Vec<Response> = (0..3).flat_map(|_| bench.exchange(&frame)).collect();
        let done = Response::Reply {
            request: sequence,
            reply: Reply::Done,
        };
        assert_eq!(replies, vec![done; 3]);
    }
    assert_eq!(bench.status().blocks, 3);

    let file = table("acetal", 1.7, 181);
    bench.send(&file, 288);
    let chunk = Request::UploadChunk {
        offset: 288,
        data: file[288..500].iter().copied().collect(),
    };
    let (_, frame) = bench.host.frame(&chunk);
    let first = bench.exchange(&frame);
    assert_eq!(bench.exchange(&frame), first);
    assert!(matches!(
        first[..],
        [Response::Reply {
            reply: Reply::Upload(Upload { received: 500, .. }),
            ..
        }]
    ));
    // Hello is done again: its reply is that of now.
    let (_, hello) = bench.host.frame(&Request::Hello);
    for _ in 0..2 {
        let [
            Response::Reply {
                reply: Reply::Info(info),
                ..
            },
        ] = &bench.exchange(&hello)[..]
        else {
            panic!("an info")
        };
        assert!(matches!(info.slots[0], Slot::Unfinished(_)));
    }
}

#[test]
fn frames_that_are_wrong_are_told_apart_and_counted() {
    let file = table("good", 1.7, 181);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.upload(&file);
    let next = bench.host.next;
    let forged = |content: &[u8]| {
        let raw = [content, &crc32([content]).to_le_bytes()].concat();
        let mut bytes = vec![0; cobs::max_encoding_length(raw.len()) + 1];
        let length = cobs::encode(&raw, &mut bytes);
        bytes[..=length].to_vec()
    };
    let good = frame(&Request::SetWorkingPoint(Some(POINT)), next);
    let mut flipped = good.clone();
    // A byte of the depth: no overhead byte of COBS.
    let at = flipped.iter().rposition(|&byte| byte == 0x40).unwrap();
    flipped[at] ^= 0x20;

    let mut refused = |bytes: &[u8]| refused_frame(&bench.exchange(bytes)).unwrap();
    assert_eq!(
        refused(&[&good[..good.len() - 3], &[0]].concat()),
        FrameError::Cobs
    );
    assert!(matches!(refused(&flipped), FrameError::Crc { .. }));
    assert_eq!(
        refused(&forged(&[9, 0, 0, 2])),
        FrameError::Version {
            ours: VERSION,
            theirs: 9
        }
    );
    assert_eq!(
        refused(&[&[7; 600], [0].as_slice()].concat()),
        FrameError::TooLong { limit: 519 }
    );
    assert_eq!(refused(&[3, 1, 1, 0]), FrameError::TooShort { found: 2 });
    assert_eq!(
        refused(&forged(&[VERSION, 0, 0, 99])),
        FrameError::UnknownMessage { variant: 99 }
    );
    assert_eq!(
        refused(&forged(&[VERSION, 0, 0, 4, 1])),
        FrameError::Body { variant: 4 }
    );
    assert_eq!(
        refused(&forged(&[VERSION, 0, 0, 2, 1])),
        FrameError::TrailingBytes { count: 1 }
    );
    let later = frame(&Request::Status, next + 1);
    assert_eq!(
        refused(&later),
        FrameError::OutOfOrder {
            expected: next,
            found: next + 1
        }
    );
    let earlier = frame(&Request::Status, next - 2);
    assert_eq!(
        refused(&earlier),
        FrameError::OutOfOrder {
            expected: next,
            found: next - 2
        }
    );

    // After all that the right frame is done, and the table is there.
    let status = bench.status();
    let errors = status.frame_errors;
    assert_eq!(
        (
            errors.cobs,
            errors.crc,
            errors.version,
            errors.too_long,
            errors.too_short
        ),
        (1, 1, 1, 1, 1)
    );
    assert_eq!(
        (
            errors.unknown_message,
            errors.body,
            errors.trailing_bytes,
            errors.out_of_order
        ),
        (1, 1, 1, 2)
    );
    assert_eq!(status.working_point, None);
    assert_eq!(bench.info().table.unwrap().name, "good");
}

#[test]
fn fed_blocks_say_the_same_to_the_bit() {
    let file = table("acetal", 1.7, 181);
    let blocks = blocks(400);
    let expected = straight(&blocks, Some(&LobeTable::parse(&file).unwrap()));

    assert!(!expected.spectra.is_empty() && !expected.strobes.is_empty());
    // On a line that takes all, and on one that takes a few bytes at a time.
    for takes in [None, Some(7)] {
        let mut state = State::default();
        let mut bench = Bench::open(&mut state, flash());
        bench.upload(&file);
        bench.ask(Request::SetWorkingPoint(Some(POINT)));
        bench.ask(Request::Subscribe(ALL));
        let mut heard = Heard::default();
        for (block, edges) in &blocks {
            let (sequence, frame) = bench.host.frame(&feed(block, edges));
            let mut responses = Vec::new();
            bench.wire.takes = takes;
            responses.extend(bench.exchange(&frame));
            while !matches!(responses.last(), Some(Response::Reply { .. })) {
                bench.wire.takes = takes;
                responses.extend(bench.exchange(&[]));
            }
            let done = Response::Reply {
                request: sequence,
                reply: Reply::Done,
            };
            assert_eq!(responses.pop(), Some(done));
            heard.take(responses);
            bench.wire.takes = None;
        }
        assert_eq!(heard.reports, expected.reports);
        assert_eq!(heard.strobes, expected.strobes);
        assert_eq!(heard.spectra, expected.spectra);
        let status = bench.status();
        assert_eq!((status.blocks, status.dropped, status.is_fed), (400, 0, true));
        // No frame of the device was lost either.
        assert!(
            bench
                .host
                .heard
                .windows(2)
                .all(|pair| pair[1] == pair[0].wrapping_add(1))
        );
    }
}

#[test]
fn edges_are_held_for_the_next_block() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.ask(Request::Subscribe(Subscription {
        reports: Reports::All,
        ..ALL
    }));
    // One edge per 20 blocks: told in `FeedEdges` or in `Feed`, the speed is the same.
    let blocks = blocks(200);
    let run = |bench: &mut Bench, before: bool| {
        assert_eq!(bench.ask(Request::Reset), Reply::Done);
        let mut heard = Heard::default();
        for (block, edges) in &blocks {
            if before {
                assert_eq!(
                    bench.ask(Request::FeedEdges(edges.iter().copied().collect())),
                    Reply::Done
                );
            }
            let (others, _) = bench.ask_all(&feed(block, if before { &[] } else { edges }));
            heard.take(others);
        }
        heard
    };
    let (with, before) = (run(&mut bench, false), run(&mut bench, true));
    assert!(
        with.reports
            .last()
            .unwrap()
            .speed
            .is_some_and(|speed| (speed.0 - 1200.0).abs() < 0.5)
    );
    assert_eq!(with, before);

    let edges = |count: u64| Request::FeedEdges((0..count).map(|k| Edge { time: Nanoseconds(k) }).collect());
    assert_eq!(bench.ask(Request::Reset), Reply::Done);
    for _ in 0..4 {
        assert_eq!(bench.ask(edges(32)), Reply::Done);
    }
    assert_eq!(
        bench.ask(edges(1)),
        Reply::Refused(Refusal::TooManyEdges { limit: 128 })
    );
}

#[test]
fn the_host_takes_the_place_of_the_sensor_and_gives_it_back() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    let blocks = blocks(4);
    let take = |bench: &mut Bench| {
        blocks
            .iter()
            .for_each(|(block, edges)| bench.device.take(block, edges))
    };
    take(&mut bench);
    assert_eq!(bench.status().blocks, 4);
    bench.ask(feed(&blocks[0].0, &blocks[0].1));
    take(&mut bench);
    let status = bench.status();
    assert_eq!((status.blocks, status.is_fed), (5, true));
    bench.ask(Request::Reset);
    take(&mut bench);
    let status = bench.status();
    assert_eq!((status.blocks, status.is_fed), (9, false));
    // A host that goes away while it feeds: the next one finds the sensor.
    bench.ask(feed(&blocks[0].0, &blocks[0].1));
    assert!(matches!(bench.ask(Request::Hello), Reply::Info(_)));
    take(&mut bench);
    let status = bench.status();
    assert_eq!(
        (status.blocks, status.is_fed, status.subscription),
        (14, false, Subscription::default())
    );
}

#[test]
fn changes_are_told_once() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.ask(Request::Subscribe(Subscription {
        reports: Reports::Changes,
        ..Subscription::default()
    }));
    let blocks = blocks(300);
    for (block, edges) in &blocks {
        bench.device.take(block, edges);
    }
    bench.device.poll(&mut bench.wire).unwrap();
    let mut heard = Heard::default();
    heard.take(bench.host.hear(&mut bench.wire));
    let mut expected = straight(&blocks, None).reports;
    // Without a working point; what is told apart is only verdict, reason and advice.
    expected.dedup_by_key(|report| (report.judgement.verdict, report.judgement.reason));
    let said: Vec<_> = heard
        .reports
        .iter()
        .map(|report| (report.sequence, report.judgement.verdict))
        .collect();
    let due: Vec<_> = expected
        .iter()
        .map(|report| (report.sequence, report.judgement.verdict))
        .collect();
    assert_eq!(said, due);
    assert!(!said.is_empty() && said.len() < 100);
}

#[test]
fn on_a_slow_line_reports_are_dropped_and_counted_but_replies_come() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.ask(Request::Subscribe(ALL));
    let blocks = blocks(300);
    let mut heard = Heard::default();
    for (index, (block, edges)) in blocks.iter().enumerate() {
        bench.wire.takes = Some(5);
        bench.device.take(block, edges);
        if index == 150 {
            let (sequence, frame) = bench.host.frame(&Request::Status);
            let mut responses = bench.exchange(&frame);
            // Behind what was on its way already, but before all that the sensor goes on to say.
            for _ in 0..3000 {
                bench.wire.takes = Some(5);
                responses.extend(bench.exchange(&[]));
            }
            let is_reply = |response: &Response| matches!(response, Response::Reply { request, .. } if *request == sequence);
            assert_eq!(responses.iter().filter(|response| is_reply(response)).count(), 1);
            responses.retain(|response| !is_reply(response));
            heard.take(responses);
        }
        heard.take(bench.exchange(&[]));
    }
    bench.wire.takes = None;
    // A spectrum that is on its way goes on in pieces.
    for _ in 0..8 {
        heard.take(bench.exchange(&[]));
    }
    let status = bench.status();
    assert!(status.dropped > 100, "{}", status.dropped);
    assert!(!heard.reports.is_empty() && heard.reports.len() < 300);
    // What came is what the pipeline said.
    let expected = straight(&blocks, None).reports;
    for report in heard.reports {
        let due = expected[report.sequence as usize];
        assert_eq!(
            (report.time, report.speed, report.judgement),
            (due.time, due.speed, due.judgement)
        );
    }
}

#[test]
fn a_line_that_stands_still_loses_no_request() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.wire.takes = Some(0);
    // A host that does not wait for replies, on a line that does not take any.
    let sent: Vec<u16> = (0..50)
        .map(|_| {
            let (sequence, frame) = bench.host.frame(&Request::Info);
            bench.wire.to_device.extend(frame);
            bench.device.poll(&mut bench.wire).unwrap();
            sequence
        })
        .collect();
    assert!(!bench.wire.to_device.is_empty(), "requests wait while replies do");
    bench.wire.takes = None;
    let replied: Vec<u16> = bench
        .exchange(&[])
        .into_iter()
        .map(|response| match response {
            Response::Reply { request, .. } => request,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(replied, sent);
}

proptest! {
    #[test]
    fn no_bytes_bring_it_down(
        noise in prop::collection::vec(any::<u8>(), 0..2000),
        bodies in prop::collection::vec(prop::collection::vec(any::<u8>(), 1..60), 0..20),
    ) {
        let mut state = State::default();
        let mut bench = Bench::open(&mut state, flash());
        bench.exchange(&noise);
        bench.exchange(&[0]);
        // Frames that are right but for their content, in order.
        for body in bodies {
            let sequence = bench.host.next.to_le_bytes();
            let content = [[VERSION, sequence[0], sequence[1]].as_slice(), &body].concat();
            let raw = [content.as_slice(), &crc32([content.as_slice()]).to_le_bytes()].concat();
            let mut bytes = vec![0; cobs::max_encoding_length(raw.len()) + 1];
            let length = cobs::encode(&raw, &mut bytes);
            let responses = bench.exchange(&bytes[..=length]);
            if responses.iter().any(|response| matches!(response, Response::Reply { .. })) {
                bench.host.next = bench.host.next.wrapping_add(1);
            }
        }
        let (_, reply) = bench.ask_all(&Request::Hello);
        prop_assert!(matches!(reply, Reply::Info(_)));
    }
}
