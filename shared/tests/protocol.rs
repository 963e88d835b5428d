//! The protocol: frozen bytes, distinct errors, streams with noise.
#![allow(clippy::unwrap_used, clippy::panic)]

#[path = "protocol/framing.rs"]
mod framing;
#[path = "protocol/samples.rs"]
mod samples;

use quietcut_core::lobes::Header;
use quietcut_core::protocol::frame::Message;
use quietcut_core::protocol::{
    Info, MAX_FRAME, Reply, Request, Response, Slot, TableSummary, Upload, VERSION,
};

use samples::*;

/// Frames of version 1, one per line: name and hexadecimal bytes. They never change.
const FROZEN_V1: &str = include_str!("protocol_v1.txt");

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
    // The index of the variant follows the COBS byte, the version and the sequence number.
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
fn messages_are_decoded_as_encoded() {
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
    // An `Info` with the longest names and largest numbers.
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
