//! Uploads of tables: complete, interrupted, invalid.

use crate::bench::*;
use crate::support::table;
use quietcut_core::lobes::{Header, TableError};
use quietcut_core::monitor::State;
use quietcut_core::protocol::{Refusal, Reply, Request, Slot, Upload};

#[test]
fn a_table_is_uploaded_and_kept_over_a_restart() {
    let file = table("acetal", 1.7, 181);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.upload(&file);
    let info = bench.info();
    let summary = info.table.unwrap();
    assert_eq!(
        (
            summary.name.as_str(),
            summary.teeth,
            summary.speeds,
            summary.layers
        ),
        ("acetal", 2, 181, 1)
    );
    assert_eq!(
        (summary.speed_from.0, summary.speed_to.0, summary.depth_to.0),
        (600.0, 2400.0, 6.0)
    );
    assert!(matches!(info.slots, [Slot::InUse(header), Slot::Empty] if header.generation == 1));

    let flash = Flash::new(bench.device.into_memory().into_bytes());
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash);
    assert_eq!(bench.info().table.unwrap().name, "acetal");
}

#[test]
fn an_upload_continues_after_a_restart() {
    let file = table("acetal", 1.7, 600);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.send(&file, 5000);
    let flash = Flash::new(bench.device.into_memory().into_bytes());

    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash);
    let header = Header::read(&file).unwrap();
    // Two pages of 2 048 bytes were complete.
    assert_eq!(
        bench.ask(Request::UploadQuery),
        Reply::Upload(Upload {
            header,
            received: 4096
        })
    );
    assert!(matches!(bench.info().slots, [Slot::Unfinished(_), Slot::Empty]));
    let incomplete = Refusal::Incomplete {
        received: 4096,
        length: header.length,
    };
    assert_eq!(bench.ask(Request::UploadCommit), Reply::Refused(incomplete));
    bench.upload(&file);
    assert_eq!(bench.info().table.unwrap().name, "acetal");
}

#[test]
fn an_invalid_table_leaves_the_last_valid_one_in_use() {
    let file = table("good", 1.7, 181);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    assert_eq!(bench.ask(Request::UploadQuery), Reply::Refused(Refusal::NoUpload));
    bench.upload(&file);

    let mut damaged = table("damaged", 1.7, 181);
    damaged[500] ^= 8;
    bench.send(&damaged, damaged.len());
    let reply = bench.ask(Request::UploadCommit);
    assert!(
        matches!(reply, Reply::Refused(Refusal::Table(TableError::Crc { .. }))),
        "{reply:?}"
    );

    let header = Header::read(&file).unwrap();
    let long = Header {
        length: 1_000_000,
        ..header
    };
    let refusal = Refusal::TableTooLong {
        length: 1_000_000,
        capacity: 15 * 2048,
    };
    assert_eq!(bench.ask(Request::UploadBegin(long)), Reply::Refused(refusal));

    bench.send(&table("given-up", 1.7, 181), 1000);
    let chunk = Request::UploadChunk {
        offset: 5000,
        data: [0; 10].into_iter().collect(),
    };
    let refusal = Refusal::ChunkOffset {
        expected: 1000,
        found: 5000,
        length: header.length,
    };
    assert_eq!(bench.ask(chunk), Reply::Refused(refusal));
    assert_eq!(bench.ask(Request::UploadAbort), Reply::Done);
    let info = bench.info();
    assert_eq!(info.table.unwrap().name, "good");
    assert_eq!(info.slots[1], Slot::Empty);
}
