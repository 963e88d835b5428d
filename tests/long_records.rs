//! Computing time of nine receptances from a record of 60 s with six channels at 10240 Hz, on one thread.
#![allow(clippy::expect_used)]

use std::path::Path;
use std::time::Instant;

use nix::sys::resource::{UsageWho, getrusage};
use quietcut::recording::{Channel, Quantity, Recording, Sidecar, TestKind};
use quietcut_tests::command::{binary, folder};
use rand::{RngExt, SeedableRng};

const RATE_HZ: f64 = 10_240.0;
const SECONDS: f64 = 60.0;

/// Three independent random forces, and a structure with one resonance per force, which responds in its own direction.
fn recording() -> Recording {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let samples = (SECONDS * RATE_HZ) as usize;
    let mut channels = Vec::new();
    let mut answers = Vec::new();
    for (force, displacement) in [("fx", "x"), ("fy", "y"), ("fz", "z")] {
        let forces: Vec<f64> = (0..samples).map(|_| rng.random_range(-50.0..50.0)).collect();
        let (mut here, mut before) = (0.0, 0.0);
        let motion = forces.iter().map(|newtons| {
            let next = 1.999 * here - 0.9998 * before + 1e-11 * newtons;
            (before, here) = (here, next);
            next
        });
        answers.push(Channel {
            name: displacement.into(),
            quantity: Quantity::Displacement,
            samples: motion.collect(),
        });
        channels.push(Channel {
            name: force.into(),
            quantity: Quantity::Force,
            samples: forces,
        });
    }
    channels.extend(answers);
    Recording {
        path: "long.csv".into(),
        sample_rate_hz: RATE_HZ,
        start_s: 0.0,
        since_s: 0.0,
        channels,
        sidecar: Sidecar {
            kind: Some(TestKind::Shaker),
            ..Sidecar::default()
        },
    }
}

/// Time in s in which the standard library parses the numbers of every line.
fn plain_pass_s(path: &Path) -> f64 {
    let began = Instant::now();
    let text = std::fs::read_to_string(path).expect("readable");
    let numbers = text
        .lines()
        .skip(1)
        .flat_map(|line| line.split(','))
        .filter_map(|field| field.parse::<f64>().ok());
    let sum: f64 = numbers.sum();
    assert!(sum.is_finite());
    began.elapsed().as_secs_f64()
}

#[test]
fn memory_stays_below_twice_the_file_and_time_near_a_plain_pass_over_it() {
    let folder = folder();
    let recording = recording();
    for ending in ["bunv", "csv", "uff"] {
        let path = folder.path().join("long").with_extension(ending);
        recording.write(&path).expect("written");
        let bytes = std::fs::metadata(&path).expect("a file").len() as f64;
        let began = Instant::now();
        let status = std::process::Command::new(binary())
            .args(["frf", "--band-hz", "10:500", "--out", "frf.csv"])
            .arg(&path)
            .current_dir(folder.path())
            .env("RAYON_NUM_THREADS", "1")
            .stdout(std::process::Stdio::null())
            .status()
            .expect("it runs");
        let seconds = began.elapsed().as_secs_f64();
        assert!(status.success());
        // Largest memory of all ended child processes, which the system gives in KiB.
        let used = getrusage(UsageWho::RUSAGE_CHILDREN).expect("known").max_rss() as f64 * 1024.0;
        println!(
            "{ending}: {:.1} MB read and made into 3 x 3 receptances in {seconds:.2} s, with at most {:.1} MB",
            bytes * 1e-6,
            used * 1e-6
        );
        assert!(used < 2.0 * bytes, "{ending}: {used} of {bytes}");
        if ending == "csv" {
            let plain_s = plain_pass_s(&path);
            println!(
                "{ending}: {:.2} of a plain pass of {plain_s:.2} s",
                seconds / plain_s
            );
            // A busy machine may slow down either of the two measurements.
            assert!(seconds < 6.0 * plain_s);
        }
    }
}
