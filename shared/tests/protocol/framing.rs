//! Damaged frames, and streams with noise.

use heapless::Vec as Heapless;
use proptest::prelude::*;
use quietcut_core::acceleration::Block;
use quietcut_core::protocol::frame::{MAX_BODY, Message, TooLarge};
use quietcut_core::protocol::message::MAX_CHUNK;
use quietcut_core::protocol::{
    Decoder, Feed, FrameError, FrameErrors, MAX_FRAME, Request, Response, Sequence, VERSION, encode,
};
use quietcut_core::units::Nanoseconds;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::samples::*;

#[test]
fn a_body_too_large_for_a_frame_is_refused() {
    #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    struct Large(Heapless<u8, 600>);
    impl Message for Large {
        const VARIANTS: u8 = 255;
    }
    let large = |byte, length| Large(core::iter::repeat_n(byte, length).collect());
    let mut buffer = [0; MAX_FRAME];
    // Two bytes of length precede the content.
    assert_eq!(encode(&large(7, MAX_BODY - 1), 0, &mut buffer), Err(TooLarge));
    let largest = large(7, MAX_BODY - 2);
    let frame = encode(&largest, 0, &mut buffer).unwrap().to_vec();
    let zeros = large(0, MAX_BODY - 2);
    assert!(encode(&zeros, 0, &mut buffer).is_ok());
    let mut decoder = Decoder::new();
    let errors: Vec<FrameError> = frame
        .iter()
        .filter_map(|&byte| decoder.push(byte)?.err())
        .collect();
    assert_eq!(errors, []);
}

#[test]
fn each_damage_has_its_own_error() {
    let frame = frame_of(&Request::SetSettings(SETTINGS));
    let error = |bytes: &[u8]| {
        let results = decode_all::<Request>(bytes);
        assert_eq!(results.len(), 1);
        results.into_iter().find_map(Result::err).unwrap()
    };
    let raw = |body: &[u8]| [&[VERSION, 0, 0], body].concat();

    // A frame that is cut off in the middle: the zero comes too early.
    assert_eq!(error(&[&frame[..20], &[0]].concat()), FrameError::Cobs);
    assert_eq!(error(&[1, 2, 0]), FrameError::Cobs);
    assert_eq!(error(&[4, 1, 2, 3, 0]), FrameError::TooShort { found: 3 });
    assert_eq!(
        error(&forged(&[VERSION, 0, 0])),
        FrameError::TooShort { found: 7 }
    );
    assert_eq!(
        error(&[&[1; 600], [0].as_slice()].concat()),
        FrameError::TooLong { limit: 519 }
    );
    let mut flipped = frame.clone();
    flipped[7] ^= 0x10;
    let FrameError::Crc {
        frame: said,
        computed,
    } = error(&flipped)
    else {
        panic!("a CRC error")
    };
    assert_ne!(said, computed);
    assert_eq!(
        error(&forged(&[2, 0, 0, 0])),
        FrameError::Version { ours: 1, theirs: 2 }
    );
    assert_eq!(
        error(&forged(&raw(&[17]))),
        FrameError::UnknownMessage { variant: 17 }
    );
    assert_eq!(
        error(&forged(&raw(&[0xFF]))),
        FrameError::UnknownMessage { variant: 255 }
    );
    assert_eq!(error(&forged(&raw(&[4, 1, 2]))), FrameError::Body { variant: 4 });
    assert_eq!(
        error(&forged(&raw(&[0, 1, 2]))),
        FrameError::TrailingBytes { count: 2 }
    );
    // A chunk whose stated length exceeds the largest possible one.
    let chunk = [8, 0, (MAX_CHUNK + 1) as u8 | 0x80, 2];
    assert_eq!(
        error(&forged(&raw(&[chunk.as_slice(), &[0; 300]].concat()))),
        FrameError::Body { variant: 8 }
    );

    // After any noise, the next frame is decoded.
    for noise in [
        &frame[..20],
        &[1, 2],
        &[4, 1, 2, 3],
        &[1; 600],
        &flipped[..flipped.len() - 1],
        &[0, 0, 0],
    ] {
        let bytes = [noise, &[0], &frame].concat();
        assert_eq!(
            decode_all(&bytes).last(),
            Some(&Ok((SEQUENCE, Request::SetSettings(SETTINGS))))
        );
    }
}

#[test]
fn errors_are_counted_by_kind() {
    let mut counts = FrameErrors::default();
    for (times, error) in frame_errors().iter().enumerate() {
        for _ in 0..=times {
            counts.count(error);
        }
    }
    assert_eq!(counts.total(), 45);
    assert_eq!(
        FrameErrors {
            out_of_order: 9,
            ..FRAME_ERRORS
        },
        counts
    );
}

#[test]
fn no_flipped_bit_becomes_a_message() {
    let mut flips = 0;
    let mut check = |frame: Vec<u8>, is_message: fn(&[u8]) -> bool| {
        for bit in 0..8 * frame.len() {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            damaged.push(0);
            assert!(!is_message(&damaged), "bit {bit} of {frame:02x?}");
            flips += 1;
        }
    };
    for request in requests() {
        check(frame_of(&request), |bytes| {
            decode_all::<Request>(bytes).iter().any(Result::is_ok)
        });
    }
    for response in responses() {
        check(frame_of(&response), |bytes| {
            decode_all::<Response>(bytes).iter().any(Result::is_ok)
        });
    }
    assert!(flips > 20_000, "{flips}");
}

#[test]
fn sequence_numbers_wrap() {
    let mut sent = Sequence::default();
    assert_eq!((sent.take(), sent.take()), (0, 1));
    let mut sent = Sequence::from(u16::MAX);
    assert_eq!((sent.take(), sent.take()), (u16::MAX, 0));

    let mut received = Sequence::default();
    assert_eq!(received.check(65_534), Ok(()));
    assert_eq!(received.check(65_535), Ok(()));
    assert_eq!(received.check(0), Ok(()));
    let out_of_order = |found| Err(FrameError::OutOfOrder { expected: 1, found });
    assert_eq!(received.check(0), out_of_order(0));
    assert_eq!(received.check(5), out_of_order(5));
    assert_eq!(received.check(1), Ok(()));
    received.restart_after(99);
    assert_eq!(received.check(100), Ok(()));
}

#[test]
fn a_stream_with_every_kind_of_damage() {
    const SEED: u64 = 20_240_611;
    println!("seed {SEED}");
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let frames: Vec<Vec<u8>> = requests().iter().map(frame_of).collect();
    let mut decoder = Decoder::new();
    let (mut good, mut bad) = (0_u32, 0_u32);
    for _ in 0..20_000 {
        let mut bytes = frames[random.random_range(0..frames.len())].clone();
        for _ in 0..random.random_range(0..3) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..5) {
                0 => bytes[at] ^= 1 << random.random_range(0..8),
                1 => bytes[at] = random.random(),
                2 => bytes.insert(at, random.random()),
                3 => bytes.truncate(at.max(1)),
                _ => bytes.extend_from_within(at..),
            }
        }
        for byte in bytes {
            match decoder
                .push(byte)
                .map(|result| result.and_then(|frame| frame.message::<Request>()))
            {
                // The decoder may return only messages that were sent.
                Some(Ok(message)) => {
                    assert!(requests().contains(&message));
                    good += 1;
                }
                Some(Err(_)) => bad += 1,
                None => {}
            }
        }
    }
    assert!(good > 5_000 && bad > 5_000, "{good} {bad}");
}

proptest! {
    #[test]
    fn no_bytes_make_the_decoder_panic_and_the_next_frame_is_read(
        noise in prop::collection::vec(any::<u8>(), 0..1500), which in 0_usize..15, zeros in any::<bool>(),
    ) {
        // Half of the noise has few zeros, so that it contains long frames and long bodies.
        let noise: Vec<u8> = noise.into_iter().map(|byte| if zeros { byte } else { byte.max(1) }).collect();
        let request = requests().remove(which);
        let bytes = [noise, vec![0], frame_of(&request)].concat();
        let decoded = decode_all(&bytes);
        prop_assert_eq!(decoded.last(), Some(&Ok((SEQUENCE, request))));
    }

    #[test]
    fn no_body_makes_the_decoder_panic(body in prop::collection::vec(any::<u8>(), 1..500)) {
        let frame = forged(&[[VERSION, 0, 0].as_slice(), &body].concat());
        let _ = decode_all::<Request>(&frame);
        let _ = decode_all::<Response>(&frame);
    }

    #[test]
    fn blocks_are_decoded_as_encoded(
        counts in prop::collection::vec(any::<[i16; 3]>(), 0..=64), sequence: u32, time: u64, lost: u32, clipped: u16,
    ) {
        let block = Block { sequence, time: Nanoseconds(time), lost, clipped, counts: counts.into_iter().collect() };
        let request = Request::Feed(Feed::new(&block, edges(3)));
        let [Ok((_, Request::Feed(feed)))] = &decode_all(&frame_of(&request))[..] else { panic!("a feed") };
        prop_assert_eq!(feed.block(), block);
        prop_assert_eq!(feed.edges.len(), 3);
    }
}
