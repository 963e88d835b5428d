//! Blocks from the host in place of the sensor, and the reports about them.

use crate::bench::*;
use crate::outputs::*;
use crate::support::{blocks, table};
use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::State;
use quietcut_core::protocol::{Refusal, Reply, Reports, Request, Response, Subscription};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;

#[test]
fn fed_blocks_give_equal_outputs_to_the_bit() {
    let file = table("acetal", 1.7, 181);
    let blocks = blocks(400);
    let expected = outputs_without_device(&blocks, Some(&LobeTable::parse(&file).unwrap()));

    assert!(!expected.spectra.is_empty() && !expected.strobes.is_empty());
    // One line accepts all bytes, the other a few bytes at a time.
    for takes in [None, Some(7)] {
        let mut state = State::default();
        let mut bench = Bench::open(&mut state, flash());
        bench.upload(&file);
        bench.ask(Request::SetWorkingPoint(Some(POINT)));
        bench.ask(Request::Subscribe(ALL));
        let mut outputs = Outputs::default();
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
            outputs.take(responses);
            bench.wire.takes = None;
        }
        assert_eq!(outputs.reports, expected.reports);
        assert_eq!(outputs.strobes, expected.strobes);
        assert_eq!(outputs.spectra, expected.spectra);
        let status = bench.status();
        assert_eq!((status.blocks, status.dropped, status.is_fed), (400, 0, true));
        // No frame of the device is missing.
        assert!(
            bench
                .host
                .sequences
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
    // One edge per 20 blocks. The speed is the same for edges in `FeedEdges` and in `Feed`.
    let blocks = blocks(200);
    let run = |bench: &mut Bench, before: bool| {
        assert_eq!(bench.ask(Request::Reset), Reply::Done);
        let mut outputs = Outputs::default();
        for (block, edges) in &blocks {
            if before {
                assert_eq!(
                    bench.ask(Request::FeedEdges(edges.iter().copied().collect())),
                    Reply::Done
                );
            }
            let (others, _) = bench.ask_all(&feed(block, if before { &[] } else { edges }));
            outputs.take(others);
        }
        outputs
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
    // A host disconnects while it feeds. For the next host, the device uses the sensor again.
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
fn changes_are_reported_once() {
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
    let mut outputs = Outputs::default();
    outputs.take(bench.host.receive(&mut bench.wire));
    let mut expected = outputs_without_device(&blocks, None).reports;
    // Without a working point, a change of verdict, reason or advice is a change of verdict or reason.
    expected.dedup_by_key(|report| (report.judgement.verdict, report.judgement.reason));
    let said: Vec<_> = outputs
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
