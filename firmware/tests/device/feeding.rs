//! Blocks from the host in the place of the sensor, and what is told of them.

use crate::bench::*;
use crate::heard::*;
use crate::support::{blocks, table};
use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::State;
use quietcut_core::protocol::{Refusal, Reply, Reports, Request, Response, Subscription};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;

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
