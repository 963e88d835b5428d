//! Requests and replies: hello, settings, repeated requests.

use crate::bench::*;
use crate::outputs::*;
use crate::support::{SETTINGS, blocks, table};
use quietcut_core::acceleration::Sensor;
use quietcut_core::monitor::{Settings, SettingsError, State};
use quietcut_core::protocol::{Refusal, Reply, Request, Response, Slot, Upload, VERSION};
use quietcut_core::units::{Degrees, Millimeters, Nanoseconds};
use quietcut_core::working_point::{Tool, WorkingPoint};

#[test]
fn a_session_begins_with_hello() {
    let mut state = State::default();
    let mut bench = Bench::new(&mut state, flash());
    assert_eq!(bench.ask(Request::Status), Reply::Refused(Refusal::HelloFirst));
    // The first request may have any sequence number; the next requests continue it.
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
    // The sequence numbers of the device have no gap.
    assert_eq!(bench.host.sequences, [0, 1, 2]);
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
fn a_request_that_comes_twice_is_done_once() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    for (block, edges) in &blocks(3) {
        let (sequence, frame) = bench.host.frame(&feed(block, edges));
        // The host repeats its request twice, as if the first two replies were lost.
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
    // Hello is performed again, so that its reply has the present content.
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
