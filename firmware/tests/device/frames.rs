//! Invalid frames.

use crate::bench::*;
use crate::support::{frame, refused_frame, table};
use quietcut_core::checksum::crc32;
use quietcut_core::monitor::State;
use quietcut_core::protocol::{FrameError, Request, VERSION};

#[test]
fn invalid_frames_have_their_own_errors_and_are_counted() {
    let file = table("good", 1.7, 181);
    let mut state = State::default();
    let mut bench = Bench::open(&mut state, flash());
    bench.upload(&file);
    let next = bench.host.next;
    let forged = |content: &[u8]| {
        let raw = [content, &crc32([content]).to_le_bytes()].concat();
        let mut bytes = vec![0; cobs::max_encoding_length(raw.len()) + 1];
        let length = cobs::encode(&raw, &mut bytes);
        bytes[..=length].to_vec()
    };
    let good = frame(&Request::SetWorkingPoint(Some(POINT)), next);
    let mut flipped = good.clone();
    // Position of a byte of the depth, which is no overhead byte of COBS.
    let at = flipped.iter().rposition(|&byte| byte == 0x40).unwrap();
    flipped[at] ^= 0x20;

    let mut refused = |bytes: &[u8]| refused_frame(&bench.exchange(bytes)).unwrap();
    assert_eq!(
        refused(&[&good[..good.len() - 3], &[0]].concat()),
        FrameError::Cobs
    );
    assert!(matches!(refused(&flipped), FrameError::Crc { .. }));
    assert_eq!(
        refused(&forged(&[9, 0, 0, 2])),
        FrameError::Version {
            ours: VERSION,
            theirs: 9
        }
    );
    assert_eq!(
        refused(&[&[7; 600], [0].as_slice()].concat()),
        FrameError::TooLong { limit: 519 }
    );
    assert_eq!(refused(&[3, 1, 1, 0]), FrameError::TooShort { found: 2 });
    assert_eq!(
        refused(&forged(&[VERSION, 0, 0, 99])),
        FrameError::UnknownMessage { variant: 99 }
    );
    assert_eq!(
        refused(&forged(&[VERSION, 0, 0, 4, 1])),
        FrameError::Body { variant: 4 }
    );
    assert_eq!(
        refused(&forged(&[VERSION, 0, 0, 2, 1])),
        FrameError::TrailingBytes { count: 1 }
    );
    let later = frame(&Request::Status, next + 1);
    assert_eq!(
        refused(&later),
        FrameError::OutOfOrder {
            expected: next,
            found: next + 1
        }
    );
    let earlier = frame(&Request::Status, next - 2);
    assert_eq!(
        refused(&earlier),
        FrameError::OutOfOrder {
            expected: next,
            found: next - 2
        }
    );

    // After all invalid frames the device accepts a valid one, and the table is unchanged.
    let status = bench.status();
    let errors = status.frame_errors;
    assert_eq!(
        (
            errors.cobs,
            errors.crc,
            errors.version,
            errors.too_long,
            errors.too_short
        ),
        (1, 1, 1, 1, 1)
    );
    assert_eq!(
        (
            errors.unknown_message,
            errors.body,
            errors.trailing_bytes,
            errors.out_of_order
        ),
        (1, 1, 1, 2)
    );
    assert_eq!(status.working_point, None);
    assert_eq!(bench.info().table.unwrap().name, "good");
}
