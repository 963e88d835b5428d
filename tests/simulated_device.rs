//! The simulated device behind its pseudo-terminal: tables come, stay and survive bad frames, and a recording is heard
//! there as it is heard here.
#![allow(clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use quietcut::device::port::{Port, SerialLine};
use quietcut::device::{Client, Pace, Setup, SimulatedDevice};
use quietcut_core::lobes::LobeTable;
use quietcut_core::protocol::message::MAX_CHUNK;
use quietcut_core::protocol::{Decoder, FrameError, MAX_FRAME, Reply, Request, Response, Upload, encode};
use quietcut_tests::command::{alone, cases, folder, quietcut};

const SECOND: Duration = Duration::from_secs(1);

/// Writes the table of the robot to `folder/robot.qct` and returns its bytes.
fn table(folder: &Path) -> Vec<u8> {
    let case = cases().join("kuka-kr90-acetal.toml");
    let case = case.to_str().expect("a path in UTF-8");
    let made = quietcut(
        folder,
        &[
            "table",
            case,
            "--rpm",
            "900:1200:2",
            "--depth-mm",
            "4",
            "--out",
            "robot.qct",
        ],
    );
    assert_eq!(made.status, Some(0), "{made:?}");
    fs::read(folder.join("robot.qct")).expect("the table is there")
}

#[test]
fn a_table_outlives_the_command_and_a_wrong_one_does_not_replace_it() {
    let folder = folder();
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments);
    let bytes = table(folder.path());
    let in_use = || run(&["info", "simulated", "--state", "device.bin", "--json"]).json();
    assert!(in_use()["table"].is_null());

    let sent = run(&[
        "upload",
        "simulated",
        "robot.qct",
        "--state",
        "device.bin",
        "--json",
    ])
    .json();
    assert_eq!(sent["bytes"], bytes.len());
    assert_eq!(sent["resumed_at"], 0);
    let first = in_use();
    assert_eq!(first["table"]["name"], "kuka-kr90-acetal");
    assert_eq!(first["slots"][0]["state"], "in-use");

    // One bit, the end, the name of another file.
    let mut wrong = bytes.clone();
    wrong[bytes.len() / 2] ^= 4;
    for (name, content, words) in [
        ("bit.qct", &wrong[..], &["bit.qct", "CRC"][..]),
        ("short.qct", &bytes[..bytes.len() - 7], &["short.qct", "bytes"]),
        ("case.qct", b"name = \"robot\"\n[tool]\nteeth = 2\n[structure]\nkind = \"modes\"\ndirections = [\"x\", \"y\", \"z\"]\n", &["case.qct"]),
        ("empty.qct", b"", &["empty.qct"]),
    ] {
        fs::write(folder.path().join(name), content).expect("a file can be written");
        run(&["upload", "simulated", name, "--state", "device.bin"]).refused(words);
    }
    run(&["upload", "simulated", "no.qct", "--state", "device.bin"]).refused(&["no.qct", "cannot read"]);
    assert_eq!(in_use()["table"], first["table"]);
    assert_eq!(in_use()["slots"], first["slots"]);
    run(&["info", "simulated", "--state", "robot.qct"]).refused(&["robot.qct", "bytes", "simulated device"]);
    run(&["info", "/dev/null", "--state", "device.bin"]).refused(&["--state", "simulated", "/dev/null"]);
}

/// A host that says what it likes.
struct RawHost {
    line: SerialLine,
    decoder: Decoder,
}

impl RawHost {
    fn open(device: &SimulatedDevice) -> Self {
        let line = SerialLine::open(device.path()).expect("the port opens");
        Self {
            line,
            decoder: Decoder::new(),
        }
    }

    fn say(&mut self, bytes: &[u8]) {
        self.line.send(bytes, SECOND).expect("the line takes bytes");
    }

    fn hear(&mut self) -> Response {
        let began = Instant::now();
        while began.elapsed() < 5 * SECOND {
            // One byte at a time: what comes behind the frame is left for the next call.
            let mut byte = [0];
            if self.line.receive(&mut byte, SECOND).expect("the line holds") == 1
                && let Some(frame) = self.decoder.push(byte[0])
            {
                return frame.expect("a whole frame").message().expect("a response");
            }
        }
        panic!("the device says nothing");
    }

    fn ask(&mut self, number: u16, request: &Request) -> Reply {
        self.say(&frame(number, request));
        match self.hear() {
            Response::Reply { request, reply } if request == number => reply,
            other => panic!("{other:?}"),
        }
    }
}

fn frame(number: u16, request: &Request) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(request, number, &mut buffer)
        .expect("a request fits a frame")
        .to_vec()
}

fn device(state: &Path) -> SimulatedDevice {
    let _alone = alone();
    let setup = Setup {
        state: Some(state),
        teeth: 2,
        pace: Pace::AsFastAsPossible,
    };
    SimulatedDevice::start(setup, channel().1).expect("a device")
}

#[test]
fn bad_frames_are_named_and_harm_nothing() {
    let folder = folder();
    table(folder.path());
    let state = folder.path().join("device.bin");
    let sent = quietcut(
        folder.path(),
        &["upload", "simulated", "robot.qct", "--state", "device.bin"],
    );
    assert_eq!(sent.status, Some(0), "{sent:?}");

    let device = device(&state);
    let mut host = RawHost::open(&device);
    let Reply::Info(before) = host.ask(100, &Request::Hello) else {
        panic!("hello is answered by info")
    };
    assert!(before.table.is_some());

    let mut refusal = |bytes: &[u8]| {
        host.say(bytes);
        match host.hear() {
            Response::FrameRefused(error) => error,
            other => panic!("{other:?}"),
        }
    };
    // An abort and a commit would do harm, were they done.
    let good = frame(101, &Request::UploadCommit);
    let truncated = [&good[..good.len() - 4], &[0]].concat();
    let error = refusal(&truncated);
    assert!(
        matches!(
            error,
            FrameError::Cobs | FrameError::TooShort { .. } | FrameError::Crc { .. }
        ),
        "{error}"
    );
    let mut corrupted = good.clone();
    corrupted[2] ^= 0x10;
    let error = refusal(&corrupted);
    assert!(matches!(error, FrameError::Crc { .. }), "{error}");
    let error = refusal(&frame(107, &Request::UploadCommit));
    assert_eq!(
        error,
        FrameError::OutOfOrder {
            expected: 101,
            found: 107
        }
    );
    let error = refusal(&[0x55; 2000]);
    assert!(matches!(error, FrameError::TooLong { .. }), "{error}");
    // Ends the frame without an end.
    host.say(&[0]);
    host.say(&other_version(101));
    let Response::FrameRefused(FrameError::Version { theirs: 99, .. }) = host.hear() else {
        panic!("a frame of version 99 is refused")
    };

    let Reply::Info(after) = host.ask(101, &Request::Info) else {
        panic!("info is answered by info")
    };
    assert_eq!(after, before);
}

/// A frame that is right in all but its version.
fn other_version(number: u16) -> Vec<u8> {
    let [low, high] = number.to_le_bytes();
    let mut raw = vec![99, low, high, 0];
    raw.extend(quietcut_core::checksum::crc32([&raw[..]]).to_le_bytes());
    // COBS by hand: each zero is replaced by the distance to the next.
    let mut cobs = Vec::new();
    for part in raw.split(|&byte| byte == 0) {
        cobs.push(part.len() as u8 + 1);
        cobs.extend(part);
    }
    cobs.push(0);
    cobs
}

#[test]
fn an_interrupted_upload_goes_on() {
    let folder = folder();
    let bytes = table(folder.path());
    let parsed = LobeTable::parse(&bytes).expect("a table");
    let state = folder.path().join("device.bin");
    // Until the flash has kept a page of it.
    {
        let device = device(&state);
        let mut host = RawHost::open(&device);
        host.ask(1, &Request::Hello);
        let mut number = 2;
        let header = parsed.header().expect("a header");
        let Reply::Upload(mut upload) = host.ask(number, &Request::UploadBegin(header)) else {
            panic!("the upload begins")
        };
        while upload.received < 3000 {
            number += 1;
            let offset = upload.received as usize;
            let data = bytes[offset..offset + MAX_CHUNK].try_into().expect("a chunk");
            let reply = host.ask(
                number,
                &Request::UploadChunk {
                    offset: upload.received,
                    data,
                },
            );
            let Reply::Upload(Upload { received, .. }) = reply else {
                panic!("{reply:?}")
            };
            upload.received = received;
        }
    }
    let sent = quietcut(
        folder.path(),
        &[
            "upload",
            "simulated",
            "robot.qct",
            "--state",
            "device.bin",
            "--json",
        ],
    )
    .json();
    let resumed_at = sent["resumed_at"].as_u64().expect("a number");
    assert!((2000..=3000).contains(&resumed_at), "{sent}");
    assert_eq!(sent["table"]["name"], "kuka-kr90-acetal");
}

#[test]
fn the_working_point_is_told_and_kept_while_the_device_is_on() {
    let folder = folder();
    let device = device(&folder.path().join("device.bin"));
    let told = quietcut(
        folder.path(),
        &[
            "work",
            device.path(),
            "--depth-mm",
            "2",
            "--start",
            "90",
            "--exit",
            "180",
            "--feed",
            "0.15",
            "--json",
        ],
    );
    let expected = serde_json::json!({"depth_mm": 2.0, "start_deg": 90.0, "exit_deg": 180.0, "feed_per_tooth_mm": 0.15, "posture": 0});
    assert_eq!(told.json()["working_point"], expected);
    // Another run, another session, the same device.
    let info = quietcut(folder.path(), &["info", device.path(), "--json"]).json();
    assert_eq!(info["working_point"], expected);
    let line = SerialLine::open(device.path()).expect("the port is free again");
    let (mut client, _) = Client::connect(Box::new(line)).expect("the device answers");
    client.set_working_point(None).expect("the device forgets");
    assert_eq!(client.status().expect("a status").working_point, None);
}

#[test]
fn a_port_in_use_is_said_to_be() {
    let folder = folder();
    let device = device(&folder.path().join("device.bin"));
    let _other = SerialLine::open(device.path()).expect("the port opens");
    quietcut(folder.path(), &["info", device.path()]).refused(&[device.path(), "cannot open"]);
}

#[test]
fn monitor_answers_with_one_object() {
    let folder = folder();
    let heard = quietcut(
        folder.path(),
        &["monitor", "simulated", "--seconds", "1", "--json"],
    )
    .json();
    assert!(
        heard["summary"]["blocks"]
            .as_u64()
            .is_some_and(|blocks| blocks > 50),
        "{heard}"
    );
    assert!(
        heard["verdicts"]
            .as_array()
            .is_some_and(|verdicts| !verdicts.is_empty()),
        "{heard}"
    );
}
