//! Faulty devices: the command answers each fault with its own message and exit status 2.
#![allow(clippy::expect_used)]

use std::fs;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use quietcut::device::pseudo_terminal::PseudoTerminal;
use quietcut_core::acceleration::Sensor;
use quietcut_core::protocol::{
    Decoder, FrameError, FrameErrors, Info, MAX_FRAME, Reply, Request, Response, Sequence, Slot, Status,
    Subscription, Upload, VERSION, encode,
};
use quietcut_core::units::Nanoseconds;
use quietcut_firmware::defaults;
use quietcut_tests::command::{Outcome, alone, folder, quietcut, start};
use quietcut_tests::small_table::table;

/// Scripted device at a pseudo-terminal.
struct FaultyDevice {
    path: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// Reaction of the script: response bytes, or the device is unplugged.
enum Act {
    Send(Vec<u8>),
    Unplug,
}

impl FaultyDevice {
    fn new(mut script: impl FnMut(u16, Request) -> Act + Send + 'static) -> Self {
        let alone = alone();
        let mut terminal = PseudoTerminal::new().expect("a pseudo-terminal");
        drop(alone);
        let path = terminal.path().to_owned();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let thread = thread::spawn(move || {
            let mut decoder = Decoder::new();
            let mut bytes = [0; 256];
            while !stopped.load(Ordering::Relaxed) {
                let count = terminal
                    .receive(&mut bytes, Duration::from_millis(5))
                    .expect("the line holds");
                for &byte in &bytes[..count] {
                    let Some(Ok(frame)) = decoder.push(byte) else {
                        continue;
                    };
                    let request = frame.message().expect("the command sends what the protocol has");
                    match script(frame.sequence, request) {
                        Act::Unplug => return,
                        Act::Send(answer) => {
                            let sent = terminal
                                .send(&answer, Duration::from_secs(1))
                                .expect("the line holds");
                            assert_eq!(sent, answer.len());
                        }
                    }
                }
            }
        });
        Self {
            path,
            stop,
            thread: Some(thread),
        }
    }

    fn info(&self) -> Outcome {
        quietcut(folder().path(), &["info", &self.path])
    }
}

impl Drop for FaultyDevice {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(matches!(ended, Some(Ok(()))), "the device of the test has failed");
    }
}

fn info() -> Info {
    Info {
        protocol: VERSION,
        board: "faulty".try_into().expect("a short name"),
        firmware: "1".try_into().expect("a short name"),
        sensor: None,
        slot_capacity: 4096,
        slots: [Slot::Empty, Slot::Empty],
        table: None,
    }
}

fn status() -> Status {
    Status {
        uptime: Nanoseconds(0),
        blocks: 0,
        clipped: 0,
        lost: 0,
        is_fed: false,
        working_point: None,
        subscription: Subscription::default(),
        frames: 0,
        frame_errors: FrameErrors::default(),
        dropped: 0,
    }
}

fn frame(sequence: u16, response: &Response) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(response, sequence, &mut buffer)
        .expect("a reply fits a frame")
        .to_vec()
}

/// Device that damages every reply in the same way.
fn spoiled(spoil: fn(&mut Vec<u8>)) -> FaultyDevice {
    let mut sequence = Sequence::default();
    FaultyDevice::new(move |request, _| {
        let reply = Response::Reply {
            request,
            reply: Reply::Info(info()),
        };
        let mut bytes = frame(sequence.take(), &reply);
        spoil(&mut bytes);
        Act::Send(bytes)
    })
}

#[test]
fn truncated_frames() {
    let device = spoiled(|bytes| {
        bytes.truncate(9);
        bytes.push(0);
    });
    device
        .info()
        .refused(&[&device.path, "hello", "frame", "check the cable"]);
}

#[test]
fn corrupted_frames() {
    let device = spoiled(|bytes| bytes[12] ^= if bytes[12] == 1 { 2 } else { 1 });
    device
        .info()
        .refused(&[&device.path, "hello", "changed on the way", "CRC-32"]);
}

#[test]
fn frames_of_another_version() {
    let device = FaultyDevice::new(|_, _| {
        let refused = FrameError::Version {
            ours: 200,
            theirs: VERSION,
        };
        Act::Send(frame(0, &Response::FrameRefused(refused)))
    });
    device
        .info()
        .refused(&[&device.path, "version 200", "same release"]);
    let device = FaultyDevice::new(|request, _| {
        let other = Info {
            protocol: 201,
            ..info()
        };
        Act::Send(frame(
            0,
            &Response::Reply {
                request,
                reply: Reply::Info(other),
            },
        ))
    });
    device
        .info()
        .refused(&[&device.path, "version 201", "same release"]);
}

#[test]
fn frames_out_of_order() {
    let mut sequence = 0_u16;
    let device = FaultyDevice::new(move |request, _| {
        sequence = sequence.wrapping_sub(3);
        Act::Send(frame(
            sequence,
            &Response::Reply {
                request,
                reply: Reply::Info(info()),
            },
        ))
    });
    // The first frame may have any sequence number; each further frame must have the next one.
    device.info().refused(&[&device.path, "settings", "was due"]);
}

#[test]
fn a_device_that_answers_something_else() {
    let mut sequence = Sequence::default();
    let device = FaultyDevice::new(move |request, asked| {
        let reply = if asked == Request::Hello {
            Reply::Info(info())
        } else {
            Reply::Done
        };
        Act::Send(frame(sequence.take(), &Response::Reply { request, reply }))
    });
    device.info().refused(&[&device.path, "`done`", "settings"]);
}

#[test]
fn a_silent_port() {
    let device = FaultyDevice::new(|_, _| Act::Send(Vec::new()));
    device
        .info()
        .refused(&[&device.path, "no answer to hello", "is it a quietcut device?"]);
}

#[test]
fn a_port_that_is_unplugged() {
    let device = FaultyDevice::new(|_, _| Act::Unplug);
    device.info().refused(&[&device.path, "unplugged"]);

    // The port is unplugged in the middle of a session, after the subscription.
    let mut sequence = Sequence::default();
    let mut subscribed = false;
    let device = FaultyDevice::new(move |request, asked| {
        if std::mem::replace(&mut subscribed, asked != Request::Hello) {
            return Act::Unplug;
        }
        let reply = if asked == Request::Hello {
            Reply::Info(info())
        } else {
            Reply::Done
        };
        Act::Send(frame(sequence.take(), &Response::Reply { request, reply }))
    });
    let monitor = start(folder().path(), &["monitor", &device.path, "--seconds", "1"]);
    monitor.finish().refused(&[&device.path, "unplugged"]);
}

/// Device that executes requests until the first one for which `is_last` is true, and is then unplugged.
fn unplugged_at(is_last: fn(&Request) -> bool) -> FaultyDevice {
    let mut sequence = Sequence::default();
    FaultyDevice::new(move |request, asked| {
        let reply = match asked {
            ref last if is_last(last) => return Act::Unplug,
            Request::Hello | Request::Info => Reply::Info(info()),
            Request::Settings => Reply::Settings(defaults::settings(Sensor::IIS3DWB_16G)),
            Request::Status => Reply::Status(status()),
            Request::UploadBegin(header) => Reply::Upload(Upload { header, received: 32 }),
            _ => Reply::Done,
        };
        Act::Send(frame(sequence.take(), &Response::Reply { request, reply }))
    })
}

#[test]
fn a_device_unplugged_during_an_upload_or_a_replay() {
    let folder = folder();
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments);
    fs::write(folder.path().join("a.qct"), table("good", 1.5, 50)).expect("a file");
    let device = unplugged_at(|request| matches!(request, Request::UploadChunk { .. }));
    run(&["upload", &device.path, "a.qct"]).refused(&[&device.path, "unplugged"]);

    let samples: String = (0..200)
        .map(|n| format!("{},0.1,{}\n", f64::from(n) * 1e-4, n % 2))
        .collect();
    let recording = format!("t [s],ax [m/s^2],tacho [1]\n{samples}");
    fs::write(folder.path().join("a.csv"), recording).expect("a file");
    let device = unplugged_at(|request| matches!(request, Request::Feed(_)));
    run(&["replay", "a.csv", "--teeth", "2", "--port", &device.path]).refused(&[&device.path, "unplugged"]);
}

#[test]
fn paths_that_are_no_ports() {
    let folder = folder();
    let run = |port: &str| quietcut(folder.path(), &["info", port]);
    run("/dev/no-such-port").refused(&["/dev/no-such-port", "no such serial port", "simulated"]);
    run("/dev/null").refused(&["/dev/null", "cannot open it as a serial port"]);
}
