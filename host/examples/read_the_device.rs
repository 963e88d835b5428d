//! Reading a device: its board and firmware, and the reports that it sends within two seconds.
//!
//! `cargo run --release -p quietcut --example read_the_device -- /dev/ttyACM0`; without a port the simulated device
//! answers.

use std::error::Error;
use std::fmt::Write;
use std::time::{Duration, Instant};

use quietcut::device::{self, Client, Event};
use quietcut::report::words;
use quietcut_core::protocol::{Reports, Subscription};

fn main() -> Result<(), Box<dyn Error>> {
    let port = std::env::args().nth(1).unwrap_or_else(|| "simulated".into());
    print!("{}", reports(&port, Duration::from_secs(2))?);
    Ok(())
}

/// The board and firmware of the device, and the reports that it sends within `time`, as text.
pub fn reports(port: &str, time: Duration) -> Result<String, Box<dyn Error>> {
    let (mut client, info) = Client::connect(device::open(port, None)?)?;
    let mut text = format!("{} with firmware {}\n", info.board, info.firmware);
    // Asks the device for a report at every change of the verdict, its reason or the advice.
    client.subscribe(Subscription {
        reports: Reports::Changes,
        ..Subscription::default()
    })?;
    let end = Instant::now() + time;
    while Instant::now() < end {
        if let Some(Event::Report(report)) = client.next_event(Duration::from_millis(100))? {
            writeln!(text, "{}", words::line(&report))?;
        }
    }
    client.subscribe(Subscription::default())?;
    Ok(text)
}
