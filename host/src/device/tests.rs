//! Tests of the client with a scripted device that also sends faulty frames.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use heapless::String;
use quietcut_core::acceleration::Block;
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{self, Content, Header, Interval, IntervalKind, Layer, LobeTable, Validity};
use quietcut_core::monitor::Report;
use quietcut_core::protocol::{
    Decoder, FrameError, Info, MAX_FRAME, Refusal, Reply, Request, Response, Sequence, Slot, Upload, VERSION,
    encode,
};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::{Degrees, Hertz, Millimeters, Nanoseconds, Rpm};

use super::port::Port;
use super::{Client, DeviceError, Event};

/// Script of a device: writes the response bytes of each request.
type Script = dyn FnMut(&mut Wire, u16, Request) + Send;

/// Device end of the line.
#[derive(Default)]
struct Wire {
    sequence: Sequence,
    bytes: VecDeque<u8>,
}

impl Wire {
    fn frame(&mut self, response: &Response) -> Vec<u8> {
        let mut buffer = [0; MAX_FRAME];
        encode(response, self.sequence.take(), &mut buffer)
            .unwrap()
            .to_vec()
    }

    fn send(&mut self, response: &Response) {
        let frame = self.frame(response);
        self.bytes.extend(frame);
    }

    fn reply(&mut self, request: u16, reply: Reply) {
        self.send(&Response::Reply { request, reply });
    }
}

struct ScriptedDevice {
    decoder: Decoder,
    wire: Wire,
    script: Box<Script>,
}

impl Port for ScriptedDevice {
    fn name(&self) -> &str {
        "script"
    }

    fn send(&mut self, bytes: &[u8], _timeout: Duration) -> Result<(), DeviceError> {
        for &byte in bytes {
            if let Some(Ok(frame)) = self.decoder.push(byte) {
                let (number, request) = (frame.sequence, frame.message::<Request>().unwrap());
                (self.script)(&mut self.wire, number, request);
            }
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], timeout: Duration) -> Result<usize, DeviceError> {
        let count = into.len().min(self.wire.bytes.len());
        for (slot, byte) in into.iter_mut().zip(self.wire.bytes.drain(..count)) {
            *slot = byte;
        }
        if count == 0 {
            std::thread::sleep(timeout.min(Duration::from_millis(1)));
        }
        Ok(count)
    }
}

fn connect(
    script: impl FnMut(&mut Wire, u16, Request) + Send + 'static,
) -> Result<(Client, Info), DeviceError> {
    let device = ScriptedDevice {
        decoder: Decoder::new(),
        wire: Wire::default(),
        script: Box::new(script),
    };
    Client::connect(Box::new(device))
}

fn info() -> Info {
    Info {
        protocol: VERSION,
        board: String::try_from("script").unwrap(),
        firmware: String::try_from("1").unwrap(),
        sensor: None,
        slot_capacity: 4096,
        slots: [Slot::Empty, Slot::Empty],
        table: None,
    }
}

fn report(sequence: u32) -> Report {
    Report {
        sequence,
        time: Nanoseconds(0),
        speed: Some(Rpm(900.0)),
        judgement: Judgement {
            verdict: Verdict::Stable,
            reason: Reason::Decaying,
            chatter: None,
            multiplier_abs: None,
            confidence: 1.0,
        },
        alarm: false,
        advice: None,
        clipped: 0,
        lost: 0,
    }
}

#[test]
fn a_request_is_repeated_with_the_same_number_after_a_lost_reply() {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let seen = asked.clone();
    let (_, answer) = connect(move |wire, number, _| {
        seen.lock().unwrap().push(number);
        if seen.lock().unwrap().len() > 2 {
            wire.reply(number, Reply::Info(info()));
        }
    })
    .unwrap();
    assert_eq!(answer, info());
    let asked = asked.lock().unwrap();
    assert!(
        asked.len() == 3 && asked.iter().all(|number| *number == asked[0]),
        "{asked:?}"
    );
}

#[test]
fn every_fault_of_a_frame_has_its_own_error() {
    let fault = |spoil: fn(&mut Vec<u8>)| {
        connect(move |wire, request, _| {
            let mut frame = wire.frame(&Response::Reply {
                request,
                reply: Reply::Info(info()),
            });
            spoil(&mut frame);
            wire.bytes.extend(frame);
        })
        .err()
        .unwrap()
    };
    let truncated = fault(|frame| {
        frame.truncate(8);
        frame.push(0);
    });
    assert!(
        matches!(
            truncated,
            DeviceError::Frames {
                error: FrameError::Cobs | FrameError::Crc { .. },
                ..
            }
        ),
        "{truncated}"
    );
    let corrupted = fault(|frame| {
        // Damages a byte of the board name, which is no COBS length byte, and never sets it to zero.
        frame[12] ^= if frame[12] == 1 { 2 } else { 1 };
    });
    assert!(
        matches!(
            corrupted,
            DeviceError::Frames {
                error: FrameError::Crc { .. },
                ..
            }
        ),
        "{corrupted}"
    );
    let endless = fault(|frame| *frame = vec![0x55; 2 * MAX_FRAME]);
    assert!(
        matches!(
            endless,
            DeviceError::Frames {
                error: FrameError::TooLong { .. },
                ..
            }
        ),
        "{endless}"
    );
    let silent = fault(Vec::clear);
    assert!(matches!(silent, DeviceError::NoAnswer { .. }), "{silent}");
}

#[test]
fn frames_out_of_order_are_refused_and_a_lost_frame_is_counted() {
    // Every reply has a wrong sequence number.
    let jumping = connect(|wire, number, request| {
        if request != Request::Hello {
            wire.sequence = Sequence::from(number.wrapping_mul(7));
        }
        for _ in 0..3 {
            wire.sequence.take();
        }
        wire.reply(number, Reply::Info(info()));
    });
    // The first frame may have any sequence number, so that hello succeeds.
    let error = jumping.unwrap().0.info().unwrap_err();
    assert!(
        matches!(
            error,
            DeviceError::Frames {
                error: FrameError::OutOfOrder { .. },
                ..
            }
        ),
        "{error}"
    );

    // One report is lost before the reply; the repeated request succeeds.
    let mut first = true;
    let (mut client, _) = connect(move |wire, number, request| {
        if request == Request::Info && std::mem::take(&mut first) {
            wire.sequence.take();
        }
        wire.reply(number, Reply::Info(info()));
    })
    .unwrap();
    assert_eq!(client.info().unwrap(), info());
    assert_eq!(client.lost_frames(), 1);
}

#[test]
fn another_protocol_version_is_an_error_at_once() {
    let error = connect(|wire, request, _| {
        wire.reply(
            request,
            Reply::Info(Info {
                protocol: 9,
                ..info()
            }),
        );
    })
    .err()
    .unwrap();
    assert!(matches!(error, DeviceError::Version { theirs: 9, .. }), "{error}");
    let error = connect(|wire, _, _| {
        let refused = FrameError::Version {
            ours: 7,
            theirs: VERSION,
        };
        wire.send(&Response::FrameRefused(refused));
    })
    .err()
    .unwrap();
    assert!(matches!(error, DeviceError::Version { theirs: 7, .. }), "{error}");
}

#[test]
fn refusals_and_wrong_replies_are_different_errors() {
    let (mut client, _) = connect(|wire, number, request| match request {
        Request::Hello => wire.reply(number, Reply::Info(info())),
        Request::SetWorkingPoint(_) => wire.reply(number, Reply::Refused(Refusal::HelloFirst)),
        _ => wire.reply(number, Reply::Done),
    })
    .unwrap();
    let refused = client.set_working_point(None).unwrap_err();
    assert!(
        matches!(
            refused,
            DeviceError::Refused {
                refusal: Refusal::HelloFirst,
                ..
            }
        ),
        "{refused}"
    );
    let wrong = client.status().unwrap_err();
    assert!(
        matches!(wrong, DeviceError::Unexpected { reply: "done", .. }),
        "{wrong}"
    );
}

#[test]
fn events_are_queued_in_order() {
    let (mut client, _) = connect(|wire, number, request| {
        if let Request::Feed(feed) = &request {
            wire.send(&Response::Report(report(feed.block().sequence)));
        }
        let reply = if request == Request::Hello {
            Reply::Info(info())
        } else {
            Reply::Done
        };
        wire.reply(number, reply);
    })
    .unwrap();
    for sequence in 0..3 {
        client
            .feed(
                &Block {
                    sequence,
                    ..Block::default()
                },
                &[],
            )
            .unwrap();
    }
    for sequence in 0..3 {
        assert_eq!(
            client.next_event(Duration::ZERO).unwrap(),
            Some(Event::Report(report(sequence)))
        );
    }
    assert_eq!(client.next_event(Duration::from_millis(1)).unwrap(), None);
    assert_eq!(client.lost_frames(), 0);
}

#[test]
fn all_edges_come_before_their_block_and_in_order() {
    let got = Arc::new(Mutex::new(Vec::new()));
    let seen = got.clone();
    let (mut client, _) = connect(move |wire, number, request| {
        match &request {
            Request::FeedEdges(edges) => seen.lock().unwrap().extend(edges.iter().copied()),
            Request::Feed(feed) => seen.lock().unwrap().extend(feed.edges.iter().copied()),
            _ => {}
        }
        let reply = if request == Request::Hello {
            Reply::Info(info())
        } else {
            Reply::Done
        };
        wire.reply(number, reply);
    })
    .unwrap();
    let edges: Vec<Edge> = (0..81).map(|i| Edge { time: Nanoseconds(i) }).collect();
    client.feed(&Block::default(), &edges).unwrap();
    assert_eq!(*got.lock().unwrap(), edges);
}

/// A table of about 3 KB.
fn table_bytes() -> Vec<u8> {
    let speeds: Vec<Rpm> = (0..200).map(|i| Rpm(600.0 + i as f32)).collect();
    let interval = Interval {
        from: Millimeters(1.0),
        to: Millimeters(4.0),
        kind: IntervalKind::Hopf,
        chatter: Hertz(17.0),
    };
    let columns: Vec<&[Interval]> = speeds.iter().map(|_| std::slice::from_ref(&interval)).collect();
    let validity = Validity {
        feed_from: Millimeters(0.15),
        feed_to: Millimeters(0.15),
        start: Degrees(90.0),
        exit: Degrees(180.0),
        posture: 0,
    };
    let content = Content {
        name: "robot",
        teeth: 2,
        limits: None,
        depth_from: Millimeters(0.0),
        depth_to: Millimeters(4.0),
        speeds: &speeds,
        layers: &[Layer {
            validity,
            columns: &columns,
        }],
    };
    let mut buffer = vec![0; lobes::encoded_length(&content) as usize];
    lobes::encode(&content, &mut buffer).unwrap().to_vec()
}

/// Script of a device that stores an upload and restarts once after `restart_after` chunks.
fn receiver(held: Arc<Mutex<Vec<u8>>>, restart_after: usize) -> impl FnMut(&mut Wire, u16, Request) + Send {
    let mut header: Option<Header> = None;
    let mut chunks = 0;
    let mut is_greeted = false;
    move |wire, number, request| {
        let mut held = held.lock().unwrap();
        let so_far = |header: Header, held: &Vec<u8>| {
            Reply::Upload(Upload {
                header,
                received: held.len() as u32,
            })
        };
        let reply = match request {
            Request::Hello => {
                is_greeted = true;
                Reply::Info(info())
            }
            _ if !is_greeted => Reply::Refused(Refusal::HelloFirst),
            Request::UploadBegin(new) => {
                header = Some(new);
                so_far(new, &held)
            }
            Request::UploadChunk { offset, data } => {
                assert_eq!(offset as usize, held.len());
                held.extend_from_slice(&data);
                chunks += 1;
                if chunks == restart_after {
                    is_greeted = false;
                }
                so_far(header.unwrap(), &held)
            }
            Request::UploadCommit => match LobeTable::parse(&held) {
                Ok(_) => Reply::Done,
                Err(error) => Reply::Refused(Refusal::Table(error)),
            },
            Request::Info => Reply::Info(info()),
            _ => Reply::Done,
        };
        wire.reply(number, reply);
    }
}

#[test]
fn an_interrupted_upload_is_resumed() {
    let bytes = table_bytes();
    let held = Arc::new(Mutex::new(bytes[..512].to_vec()));
    let (mut client, _) = connect(receiver(held.clone(), 0)).unwrap();
    let mut steps = Vec::new();
    let done = client
        .upload(&LobeTable::parse(&bytes).unwrap(), |sent, all| {
            steps.push((sent, all))
        })
        .unwrap();
    assert_eq!(done.resumed_at, 512);
    assert_eq!(steps.first(), Some(&(512, bytes.len() as u32)));
    assert_eq!(steps.last(), Some(&(bytes.len() as u32, bytes.len() as u32)));
    assert_eq!(*held.lock().unwrap(), bytes);
}

#[test]
fn an_upload_survives_a_restart_of_the_device() {
    let bytes = table_bytes();
    let held = Arc::new(Mutex::new(Vec::new()));
    let (mut client, _) = connect(receiver(held.clone(), 3)).unwrap();
    let done = client
        .upload(&LobeTable::parse(&bytes).unwrap(), |_, _| {})
        .unwrap();
    assert_eq!(done.resumed_at, 0);
    assert_eq!(*held.lock().unwrap(), bytes);
}

#[test]
fn a_table_that_the_device_refuses_is_an_error() {
    let bytes = table_bytes();
    // The device holds other bytes of an earlier upload.
    let held = Arc::new(Mutex::new(vec![0; 512]));
    let (mut client, _) = connect(receiver(held, 0)).unwrap();
    let refused = client
        .upload(&LobeTable::parse(&bytes).unwrap(), |_, _| {})
        .unwrap_err();
    assert!(
        matches!(
            refused,
            DeviceError::Refused {
                refusal: Refusal::Table(_),
                ..
            }
        ),
        "{refused}"
    );
}
