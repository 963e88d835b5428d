//! Cuts of `simulated_cuts` in the emulator, in the campaigns all twenty: its reports equal those of the host to the bit.
#![allow(clippy::expect_used)]

use std::sync::Mutex;
use std::time::Instant;

use quietcut::device::Client;
use quietcut_core::protocol::{Reports, Subscription};
use quietcut_testkit::slice;
use quietcut_tests::acceptance::{ABOVE, AcceptanceCut, BELOW, LIMITS};
use quietcut_tests::emulator::{Emulator, Memory, PATIENCE};
use quietcut_tests::outputs::{ChainOutputs, steps, stimuli};

/// Subscription to all reports. Spectra and stroboscopic points take longer to send than to compute; `emulated_device` compares
/// them.
const REPORTS: Subscription = Subscription {
    reports: Reports::All,
    spectra: false,
    strobes: false,
};

/// Runs the signal chain over the cut on host and emulator. Returns the outputs of the emulator.
fn emulated(cut: &AcceptanceCut) -> ChainOutputs {
    let sensed = cut
        .cut
        .sense(&cut.case, cut.accelerometer, cut.tachometer, cut.seed)
        .expect("a cut that can be simulated");
    let steps = steps(sensed);
    let host = ChainOutputs::on_host(cut.settings(), None, None, &steps);
    let memory = Memory::erased();
    let mut emulator = Emulator::start(&memory);
    let (mut client, _) = Client::connect(Box::new(emulator.port())).expect("the device answers");
    client.set_settings(cut.settings()).expect("settings that can be");
    client.subscribe(REPORTS).expect("a subscription");
    let began = Instant::now();
    let device = std::thread::scope(|scope| {
        scope.spawn(|| emulator.feed_stored(&stimuli(&steps)));
        ChainOutputs::from_device(&mut client, steps.len(), PATIENCE)
    });
    let status = client.status().expect("an answer");
    assert_eq!((status.dropped, client.lost_frames()), (0, 0));
    println!(
        "{cut}: {} reports in {:.1?}",
        device.reports.len(),
        began.elapsed()
    );
    host.assert_same_reports(&device);
    device
}

#[test]
fn the_verdicts_on_cuts_are_right_and_equal_those_of_the_host() {
    let cuts = (0..LIMITS.len())
        .step_by(slice(3, 1) as usize)
        .flat_map(|index| [(index, BELOW), (index, ABOVE)]);
    let cuts = Mutex::new(cuts);
    let next = || cuts.lock().expect("no worker panics here").next();
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((index, share)) = next() {
                    let cut = AcceptanceCut::new(index, share);
                    let said = emulated(&cut);
                    let right = (share > 1.0).then_some(LIMITS[index].2);
                    assert_eq!(said.first_alarm(), right, "{cut}");
                }
            });
        }
    });
}
