//! Lines that are slow or accept no bytes.

use crate::bench::*;
use crate::outputs::*;
use crate::support::blocks;
use proptest::prelude::*;
use quietcut_core::checksum::crc32;
use quietcut_core::monitor::State;
use quietcut_core::protocol::{Reply, Request, Response, VERSION};

#[test]
fn on_a_slow_line_reports_are_dropped_and_counted_but_replies_come() {
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.ask(Request::Subscribe(ALL));
    let blocks = blocks(300);
    let mut outputs = Outputs::default();
    for (index, (block, edges)) in blocks.iter().enumerate() {
        bench.wire.takes = Some(5);
        bench.device.take(block, edges);
        if index == 150 {
            let (sequence, frame) = bench.host.frame(&Request::Status);
            let mut responses = bench.exchange(&frame);
            // The reply follows the messages that are already on the way, and precedes all later messages of the sensor.
            for _ in 0..3000 {
                bench.wire.takes = Some(5);
                responses.extend(bench.exchange(&[]));
            }
            let is_reply = |response: &Response| matches!(response, Response::Reply { request, .. } if *request == sequence);
            assert_eq!(responses.iter().filter(|response| is_reply(response)).count(), 1);
            responses.retain(|response| !is_reply(response));
            outputs.take(responses);
        }
        outputs.take(bench.exchange(&[]));
    }
    bench.wire.takes = None;
    // The rest of a spectrum is sent in chunks.
    for _ in 0..8 {
        outputs.take(bench.exchange(&[]));
    }
    let status = bench.status();
    assert!(status.dropped > 100, "{}", status.dropped);
    assert!(!outputs.reports.is_empty() && outputs.reports.len() < 300);
    // The reports that arrive are those of the signal chain.
    let expected = outputs_without_device(&blocks, None).reports;
    for report in outputs.reports {
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
    // The host does not wait for replies, and the line does not accept them.
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
    fn no_bytes_stop_the_device(
        noise in prop::collection::vec(any::<u8>(), 0..2000),
        bodies in prop::collection::vec(prop::collection::vec(any::<u8>(), 1..60), 0..20),
    ) {
        let mut state = State::default();
        let mut bench = Bench::open(&mut state, flash());
        bench.exchange(&noise);
        bench.exchange(&[0]);
        // Valid frames with random content, with the right sequence numbers.
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
