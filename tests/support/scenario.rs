//! Scenarios of the protocol between host and device, for emulated and simulated devices.

use quietcut::device::Client;
use quietcut::device::port::Port;
use quietcut_core::lobes::{LobeTable, TableError};
use quietcut_core::protocol::message::MAX_CHUNK;
use quietcut_core::protocol::{FrameError, Info, Refusal, Reply, Request, Response, Slot};

use crate::command::{WORKING_POINT, cases, folder, quietcut, words};
use crate::raw_host::{RawHost, frame, frame_of_version};
use crate::small_table::table;

/// Opens the line to the device of a test; one line is open at a time.
pub type Open<'a> = &'a dyn Fn() -> Box<dyn Port>;

/// Connects a client; returns it with the identity of the device.
pub fn connect(open: Open<'_>) -> (Client, Info) {
    Client::connect(open()).expect("the device answers")
}

/// Uploads a table with the client; returns the identity and memory of the device afterwards.
pub fn upload(client: &mut Client, bytes: &[u8]) -> Info {
    let table = LobeTable::parse(bytes).expect("a table");
    client
        .upload(&table, |_, _| ())
        .expect("the device takes the table")
        .info
}

/// Name of the table in use; empty if there is none.
pub fn name_in_use(info: &Info) -> &str {
    info.table.as_ref().map_or("", |table| table.name.as_str())
}

/// Uploads a table with the command to the serial port `port`, sets the working point, and reads both back.
pub fn the_command_uploads_a_table_and_sets_and_reads_the_working_point(port: &str) {
    let folder = folder();
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments).json();
    std::fs::write(folder.path().join("kuka.qct"), table("kuka", 1.5, 100)).expect("a file");
    let uploaded = run(&["upload", port, "kuka.qct", "--json"]);
    assert_eq!(uploaded["table"]["name"], "kuka", "{uploaded}");
    let cut = words(WORKING_POINT);
    let expected = serde_json::json!({"depth_mm": 2.0, "start_deg": 90.0, "exit_deg": 180.0, "feed_per_tooth_mm": 0.15, "posture": 0});
    let told = run(&[&["working-point", port, "--json"], &cut[..]].concat());
    assert_eq!(told["working_point"], expected);
    assert_eq!(told["feed_direction_deg"], serde_json::Value::Null);
    let direction = ["--feed-direction-deg", "30"];
    let told = run(&[&["working-point", port, "--json"], &cut[..], &direction[..]].concat());
    assert_eq!(told["feed_direction_deg"], 30.0);
    // A second run of the command opens a new session with the same device.
    let info = run(&["info", port, "--json"]);
    assert_eq!(info["table"]["name"], "kuka", "{info}");
    assert_eq!(info["working_point"], expected);
    assert_eq!(info["feed_direction_deg"], 30.0);
    assert_eq!(info["frame_errors"], 0, "{info}");
}

/// Replays a recording with chatter on the device at the serial port `port`: the output equals, to the last digit, that of the signal
/// chain on the host, and the device keeps its settings except for the table.
pub fn a_recording_gives_the_same_reports_there_as_here(port: &str) {
    let folder = folder();
    let run = |arguments: &[&str]| {
        let ran = quietcut(folder.path(), arguments);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        ran.stdout
    };
    let case = cases().join("kuka-kr90-acetal.toml");
    let case = case.to_str().expect("a path in UTF-8");
    // Few samples: the emulated port is slow. The chatter at 17 Hz does not need more.
    let cut = ["--depth-mm", "2", "--seconds", "8", "--sample-rate-hz", "2000"];
    run(&[&["simulate", case, "--rpm", "1045", "--out", "cut.csv"], &cut[..]].concat());
    std::fs::write(folder.path().join("kuka.qct"), table("kuka", 1.5, 100)).expect("a file");
    let settings = || run(&["info", port, "--json"]);
    let before: serde_json::Value = serde_json::from_str(&settings()).expect("JSON");
    let replay = ["replay", "cut.csv", "--table", "kuka.qct", "--json"];
    let here = run(&replay);
    let there = run(&[&replay[..], &["--port", port]].concat());
    assert!(
        here.contains("period-doubling") && here.contains(r#""source":"table""#),
        "{here}"
    );
    assert_eq!(here, there);
    let after: serde_json::Value = serde_json::from_str(&settings()).expect("JSON");
    for key in [
        "sample_rate_hz",
        "teeth",
        "working_point",
        "frame_errors",
        "dropped",
    ] {
        assert!(before.get(key).is_some(), "{before}");
        assert_eq!(before[key], after[key], "{key}: {after}");
    }
}

/// Truncated, damaged, disordered, oversized frames and frames of another version are refused with their own errors and change neither
/// table nor slots.
pub fn invalid_frames_have_their_own_errors_and_change_nothing(open: Open<'_>) {
    let (mut client, _) = connect(open);
    upload(&mut client, &table("kept", 1.5, 50));
    drop(client);
    let mut host = RawHost::new(open());
    let Reply::Info(before) = host.ask(100, &Request::Hello) else {
        panic!("hello is answered by info")
    };
    assert_eq!(name_in_use(&before), "kept");

    let mut refusal = |bytes: &[u8]| {
        host.send(bytes);
        match host.receive() {
            Response::FrameRefused(error) => error,
            other => panic!("{other:?}"),
        }
    };
    // An executed commit would change the table.
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
    // A zero byte ends the unfinished frame.
    host.send(&[0]);
    host.send(&frame_of_version(99, 101));
    let Response::FrameRefused(FrameError::Version { theirs: 99, .. }) = host.receive() else {
        panic!("a frame of version 99 is refused")
    };

    let Reply::Info(after) = host.ask(101, &Request::Info) else {
        panic!("info is answered by info")
    };
    assert_eq!(after, before);
}

/// A table with a wrong CRC, sent without the checks of the client, is refused; the last valid table stays in use.
pub fn a_table_with_a_wrong_crc_does_not_replace_the_last_good_one(open: Open<'_>) {
    let (mut client, _) = connect(open);
    let before = upload(&mut client, &table("good", 1.5, 50));
    drop(client);
    let mut bytes = table("wrong", 2.5, 50);
    let header = LobeTable::parse(&bytes)
        .expect("a table")
        .header()
        .expect("a header");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;

    let mut host = RawHost::new(open());
    host.ask(1, &Request::Hello);
    let mut reply = host.ask(2, &Request::UploadBegin(header));
    let mut number = 3;
    while let Reply::Upload(upload) = reply {
        let offset = upload.received as usize;
        let Some(rest) = bytes.get(offset..).filter(|rest| !rest.is_empty()) else {
            break;
        };
        let data = rest[..rest.len().min(MAX_CHUNK)].try_into().expect("a chunk");
        let offset = upload.received;
        reply = host.ask(number, &Request::UploadChunk { offset, data });
        number += 1;
    }
    let reply = host.ask(number, &Request::UploadCommit);
    assert!(
        matches!(reply, Reply::Refused(Refusal::Table(TableError::Crc { .. }))),
        "{reply:?}"
    );
    let Reply::Info(after) = host.ask(number + 1, &Request::Info) else {
        panic!("info is answered by info")
    };
    assert_eq!(after.table, before.table);
    let good = |info: &Info| {
        info.slots
            .iter()
            .filter(|slot| matches!(slot, Slot::InUse(_)))
            .count()
    };
    assert_eq!((good(&after), good(&before)), (1, 1), "{after:?}");
}
