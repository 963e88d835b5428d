//! Simulated device at its pseudo-terminal: uploaded tables persist and survive invalid frames, and a recording gives the same verdicts
//! as on the host.
#![allow(clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;
use std::sync::mpsc::channel;

use quietcut::device::port::{Port, SerialLine};
use quietcut::device::{Pace, Setup, SimulatedDevice};
use quietcut_core::lobes::LobeTable;
use quietcut_core::protocol::message::MAX_CHUNK;
use quietcut_core::protocol::{Reply, Request, Upload};
use quietcut_tests::command::{alone, cases, folder, quietcut};
use quietcut_tests::raw_host::RawHost;
use quietcut_tests::scenario;

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

    // Four wrong files: a flipped bit, missing bytes at the end, a case in place of a table, and no bytes.
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

fn device(state: &Path) -> SimulatedDevice {
    let _alone = alone();
    let setup = Setup {
        state: Some(state),
        teeth: 2,
        pace: Pace::AsFastAsPossible,
    };
    SimulatedDevice::start(setup, channel().1).expect("a device")
}

/// Opens the line to a simulated device.
fn line(device: &SimulatedDevice) -> Box<dyn Port> {
    Box::new(SerialLine::open(device.path()).expect("the port opens"))
}

#[test]
fn invalid_frames_have_their_own_errors_and_change_nothing() {
    let folder = folder();
    let device = device(&folder.path().join("device.bin"));
    scenario::invalid_frames_have_their_own_errors_and_change_nothing(&|| line(&device));
}

#[test]
fn a_table_with_a_wrong_crc_does_not_replace_the_last_good_one() {
    let folder = folder();
    let device = device(&folder.path().join("device.bin"));
    scenario::a_table_with_a_wrong_crc_does_not_replace_the_last_good_one(&|| line(&device));
}

#[test]
fn the_command_replays_a_recording() {
    let folder = folder();
    let device = device(&folder.path().join("device.bin"));
    scenario::a_recording_gives_the_same_reports_there_as_here(device.path());
}

#[test]
fn an_interrupted_upload_goes_on() {
    let folder = folder();
    let bytes = table(folder.path());
    let parsed = LobeTable::parse(&bytes).expect("a table");
    let state = folder.path().join("device.bin");
    // The upload is interrupted once the flash holds a complete page.
    {
        let device = device(&state);
        let mut host = RawHost::new(line(&device));
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
fn the_working_point_is_set_and_kept_while_the_device_is_on() {
    let folder = folder();
    let device = device(&folder.path().join("device.bin"));
    scenario::the_command_uploads_a_table_and_sets_and_reads_the_working_point(device.path());
    let (mut client, _) = scenario::connect(&|| line(&device));
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
    let replayed = quietcut(
        folder.path(),
        &["monitor", "simulated", "--seconds", "1", "--json"],
    )
    .json();
    assert!(
        replayed["summary"]["blocks"]
            .as_u64()
            .is_some_and(|blocks| blocks > 50),
        "{replayed}"
    );
    assert!(
        replayed["verdicts"]
            .as_array()
            .is_some_and(|verdicts| !verdicts.is_empty()),
        "{replayed}"
    );
}
