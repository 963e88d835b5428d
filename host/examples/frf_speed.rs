//! Computing time and memory for the FRF of a long recording: 60 s of three forces and three accelerations at 10 240
//! Hz, read as CSV, to a 3 × 3 FRF.
//!
//! `cargo run --release -p quietcut --example frf_speed` prints the shortest times of ten rounds. They are processor
//! times of one thread where the system reports these, so that other load on the machine hardly matters. Where the
//! system reports it, the memory for reading is printed in MB and as a multiple of the file's size. The file is written
//! to a temporary folder.

use std::error::Error;
use std::io::Write;
use std::time::Instant;

use quietcut::frf::{MeasurementSettings, measure};
use quietcut::recording::Recording;
use rand::{RngExt, SeedableRng};

const RATE: f64 = 10_240.0;
const SECONDS: f64 = 60.0;
const ROUNDS: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("cut.csv");
    write_record(&path)?;
    let megabytes = std::fs::metadata(&path)?.len() as f64 / 1e6;
    let before = peak_megabytes();
    let recording = Recording::read(&path)?;
    let after = peak_megabytes();
    let origin = Instant::now();
    let (mut reading, mut measuring) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        let start = clock_s(&origin);
        let read = Recording::read(&path)?;
        reading = reading.min(clock_s(&origin) - start);
        drop(read);
        let start = clock_s(&origin);
        let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default())?;
        measuring = measuring.min(clock_s(&origin) - start);
        assert_eq!(measurement.table.entries().len(), 9);
    }
    println!(
        "file: {megabytes:.1} MB, {} samples of {} channels",
        recording.len(),
        recording.channels.len()
    );
    println!(
        "read: {reading:.3} s; 3 x 3 FRF after reading: {measuring:.3} s; together {:.3} s",
        reading + measuring
    );
    if let (Some(before), Some(after)) = (before, after) {
        println!(
            "memory of reading: {:.1} MB, {:.2} of the file",
            after - before,
            (after - before) / megabytes
        );
    }
    Ok(())
}

/// Writes a recording file: the time with six decimals, and noise with eight decimals in six channels.
fn write_record(path: &std::path::Path) -> Result<(), Box<dyn Error>> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    writeln!(
        file,
        "t [s],fx [N],fy [N],fz [N],ax [m/s^2],ay [m/s^2],az [m/s^2]"
    )?;
    for k in 0..(SECONDS * RATE) as u64 {
        write!(file, "{:.6}", k as f64 / RATE)?;
        for _ in 0..6 {
            write!(file, ",{:.8}", random.random_range(-9.0..9.0_f64))?;
        }
        writeln!(file)?;
    }
    file.flush()?;
    Ok(())
}

/// Processor time of this thread, s; where the system does not report it, the time since `origin`.
fn clock_s(origin: &Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| origin.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

/// Largest memory that this process has used so far, MB; `None` where the system does not report it.
fn peak_megabytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    // The system says kB and means 1024 bytes.
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes * 1024e-6)
}
