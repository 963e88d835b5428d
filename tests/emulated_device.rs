//! Hardware in the loop with simulated signals: the ARM image runs in the emulator, a virtual spindle feeds it, and the host's
//! client and the real command send requests.
#![allow(clippy::expect_used, clippy::panic)]

use std::time::{Duration, Instant};

use quietcut::device::Client;
use quietcut::simulate::Entry;
use quietcut_core::lobes::LobeTable;
use quietcut_core::protocol::{Info, Slot, VERSION};
use quietcut_tests::cut::Cut;
use quietcut_tests::emulator::{self, Cost, Emulator, Memory, PATIENCE};
use quietcut_tests::firmware_image;
use quietcut_tests::outputs::{ALL, ChainOutputs, Step, stimuli};
use quietcut_tests::scenario::{self, name_in_use, upload};
use quietcut_tests::small_table::table;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Connects the client to an emulated device.
fn connect(emulator: &Emulator<'_>) -> (Client, Info) {
    scenario::connect(&|| Box::new(emulator.port()))
}

#[test]
fn the_board_starts_and_states_its_identity() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    assert!(
        emulator.log().contains("INFO quietcut on mps2-an386"),
        "{}",
        emulator.log()
    );
    let (mut client, info) = connect(&emulator);
    assert_eq!(info.board, "qemu-mps2");
    assert_eq!(info.protocol, VERSION);
    assert_eq!(info.sensor, None);
    assert_eq!(info.slots, [Slot::Empty, Slot::Empty]);
    assert_eq!(info.table, None);
    assert_eq!(client.status().expect("an answer").frame_errors.total(), 0);
}

#[test]
fn the_command_uploads_a_table_and_sets_and_reads_the_working_point() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    scenario::the_command_uploads_a_table_and_sets_and_reads_the_working_point(
        emulator.serial_device().path(),
    );
}

#[test]
fn the_command_replays_a_recording() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    scenario::a_recording_gives_the_same_reports_there_as_here(emulator.serial_device().path());
}

#[test]
fn invalid_frames_have_their_own_errors_and_change_nothing() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    scenario::invalid_frames_have_their_own_errors_and_change_nothing(&|| Box::new(emulator.port()));
}

#[test]
fn a_table_with_a_wrong_crc_does_not_replace_the_last_good_one() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    scenario::a_table_with_a_wrong_crc_does_not_replace_the_last_good_one(&|| Box::new(emulator.port()));
}

#[test]
fn a_table_survives_a_restart() {
    let memory = Memory::erased();
    let bytes = table("lasting", 1.5, 200);
    let emulator = Emulator::start(&memory);
    let (mut client, _) = connect(&emulator);
    let began = Instant::now();
    let info = upload(&mut client, &bytes);
    println!("upload of {} bytes: {:?}", bytes.len(), began.elapsed());
    assert_eq!(name_in_use(&info), "lasting");
    emulator.kill();
    let emulator = Emulator::start(&memory);
    let (_, info) = connect(&emulator);
    assert_eq!(name_in_use(&info), "lasting");
    // The flash contains the payload of the file without change, after the header with the device's generation.
    let flash = memory.flash();
    assert!(
        flash
            .windows(bytes.len() - 32)
            .any(|window| *window == bytes[32..])
    );
}

#[test]
fn a_power_cut_leaves_the_old_or_the_new_table() {
    const CUTS: usize = 12;
    let seed: u64 = rand::random();
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let memory = Memory::erased();
    let tables = [table("even", 1.5, 300), table("odd", 2.5, 300)];
    let names = ["even", "odd"];
    let emulator = Emulator::start(&memory);
    let (mut client, _) = connect(&emulator);
    let began = Instant::now();
    upload(&mut client, &tables[0]);
    let whole = began.elapsed();
    emulator.kill();

    let mut kept = 0;
    for cut in 1..=CUTS {
        let (old, new) = (names[(cut + 1) % 2], names[cut % 2]);
        let emulator = Emulator::start(&memory);
        let (mut client, info) = connect(&emulator);
        assert_eq!(name_in_use(&info), old, "cut {cut}");
        let uploading = std::thread::spawn({
            let bytes = tables[cut % 2].clone();
            move || {
                let table = LobeTable::parse(&bytes).expect("a table");
                client.upload(&table, |_, _| ()).is_ok()
            }
        });
        // Power fails at a random time up to 1.25 times the duration of an upload, so that some uploads complete.
        let wait = whole.mul_f64(random.random_range(0.0..1.25));
        std::thread::sleep(wait);
        emulator.kill();
        let is_told_done = uploading.join().expect("the upload ends");

        let emulator = Emulator::start(&memory);
        let (mut client, info) = connect(&emulator);
        let found = name_in_use(&info).to_owned();
        assert!(
            found == old || found == new,
            "cut {cut} after {wait:?}: {found:?} is in use"
        );
        assert!(
            !is_told_done || found == new,
            "cut {cut} after {wait:?}: the upload was done"
        );
        kept += usize::from(found == old);
        // From every state after the loss of power, the upload can continue and end with the new table.
        assert_eq!(
            name_in_use(&upload(&mut client, &tables[cut % 2])),
            new,
            "cut {cut} after {wait:?}"
        );
    }
    println!("an upload takes {whole:?}; {kept} of {CUTS} cuts left the old table");
    assert!(kept > 0, "no cut came in the middle of an upload");
}

#[test]
fn a_damaged_table_is_not_used() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    let (mut client, _) = connect(&emulator);
    let info = upload(&mut client, &table("older", 1.5, 50));
    assert!(matches!(info.slots, [Slot::InUse(_), _]), "{info:?}");
    let newer = table("newer", 2.5, 50);
    let info = upload(&mut client, &newer);
    let slot = info
        .slots
        .iter()
        .position(|slot| matches!(slot, Slot::InUse(_)))
        .expect("a slot in use");
    emulator.kill();
    let at = slot * memory.flash().len() / 2 + newer.len() / 2;
    let byte = memory.flash()[at];
    memory.damage(at, &[byte ^ 0x10]);
    let emulator = Emulator::start(&memory);
    let (_, info) = connect(&emulator);
    assert_eq!(name_in_use(&info), "older");
    assert!(matches!(info.slots[slot], Slot::Damaged(_)), "{info:?}");
}

/// Configures host and device equally and runs both over the same cut. `feed` passes the cut to the device.
fn assert_same_to_the_bit(cut: &Cut, feed: impl FnOnce(&mut Emulator<'_>, &[Step]) + Send) -> Cost {
    let memory = Memory::erased();
    let mut emulator = Emulator::start(&memory);
    let (mut client, _) = connect(&emulator);
    let table = table("acetal", 1.5, 181);
    upload(&mut client, &table);
    client.set_settings(cut.settings).expect("settings that can be");
    client
        .set_working_point(Some(cut.working_point))
        .expect("a cut that can be");
    client.subscribe(ALL).expect("a subscription");
    let host = ChainOutputs::on_host(cut.settings, Some(&table), Some(&cut.working_point), &cut.steps);
    let device = std::thread::scope(|scope| {
        scope.spawn(|| feed(&mut emulator, &cut.steps));
        ChainOutputs::from_device(&mut client, cut.steps.len(), PATIENCE)
    });
    host.assert_same(&device);
    let status = client.status().expect("an answer");
    assert_eq!((status.dropped, client.lost_frames()), (0, 0));
    println!(
        "{} reports, {} blocks with strobes, {} spectra: the same to the bit",
        host.reports.len(),
        host.strobes.len(),
        host.spectra.len()
    );
    emulator.cost()
}

#[test]
fn outputs_equal_those_of_the_host_to_the_bit() {
    // A flip, with entry into the material and exit.
    let cut = Cut::new(Entry::Feed, 1045.0, 2.0, 4.0, 1);
    let samples: usize = cut.steps.iter().map(|(block, _)| block.counts.len()).sum();
    let cost = assert_same_to_the_bit(&cut, |emulator, steps| {
        let began = Instant::now();
        emulator.feed_stored(&stimuli(steps));
        println!(
            "memory: {:.0} samples/s",
            samples as f64 / began.elapsed().as_secs_f64()
        );
    });
    let (stack, room) = (cost.stack_bytes, firmware_image::nucleo_stack_bytes());
    println!("stack: {stack} bytes of {room} on the real board");
    // On the real board, interrupts add to the stack: four priorities, one of which reads the sensor.
    assert!(stack + 4096 <= room);
}

#[test]
fn blocks_arrive_over_the_serial_port() {
    // A Hopf case with one block lost, one block clipped, and one without edges.
    let mut cut = Cut::new(Entry::None, 900.0, 2.0, 0.8, 2);
    cut.steps.remove(50);
    cut.steps[100].0.lost = 3;
    let clipped = &mut cut.steps[150].0;
    clipped.counts[7] = [i16::MAX, 0, i16::MIN];
    clipped.clipped = 1;
    cut.steps[200].1.clear();
    let samples: usize = cut.steps.iter().map(|(block, _)| block.counts.len()).sum();
    assert_same_to_the_bit(&cut, |emulator, steps| {
        let began = Instant::now();
        emulator.feed(&stimuli(steps));
        println!(
            "serial port: {:.0} samples/s",
            samples as f64 / began.elapsed().as_secs_f64()
        );
    });
}

#[test]
fn blocks_arrive_over_the_link() {
    let cut = Cut::new(Entry::None, 1045.0, 2.0, 0.4, 3);
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    let (mut client, _) = connect(&emulator);
    client.set_settings(cut.settings).expect("settings that can be");
    client.subscribe(ALL).expect("a subscription");
    let began = Instant::now();
    for (block, edges) in &cut.steps {
        client.feed(block, edges).expect("the device takes a block");
    }
    println!(
        "link: {:.0} blocks/s",
        cut.steps.len() as f64 / began.elapsed().as_secs_f64()
    );
    let device = ChainOutputs::from_device(&mut client, cut.steps.len(), Duration::from_secs(1));
    ChainOutputs::on_host(cut.settings, None, None, &cut.steps).assert_same(&device);
    assert!(client.status().expect("an answer").is_fed);
}

#[test]
fn a_refused_stimulus_is_answered() {
    let memory = Memory::erased();
    let mut emulator = Emulator::start(&memory);
    assert!(!emulator.takes_frame(b"\x03no\x00"));
    let overlong: Vec<u8> = (0..2000).map(|i| u8::from(i < 1999)).collect();
    assert!(!emulator.takes_frame(&overlong));
    // The board continues after the refused stimuli.
    emulator.feed(&stimuli(&Cut::new(Entry::None, 1045.0, 0.5, 0.1, 4).steps[..3]));
}

#[test]
fn keeps_up_with_the_sensor() {
    let cut = Cut::new(Entry::Feed, 1045.0, 2.0, 4.0, 1);
    let memory = Memory::erased();
    let mut emulator = Emulator::start_counting(&memory);
    let (mut client, _) = connect(&emulator);
    upload(&mut client, &table("acetal", 1.5, 181));
    client.set_settings(cut.settings).expect("settings that can be");
    client
        .set_working_point(Some(cut.working_point))
        .expect("a cut that can be");
    emulator.feed_stored(&stimuli(&cut.steps));
    let (mean, most) = emulator.cost().instructions();
    println!("instructions for a block of 64 samples: {mean:.0} in the mean, {most:.0} at most");
    let of_a_block = 64.0 / 26_667.0;
    // On the real board, reading the sensor takes a fifth of the time.
    assert!(seconds_on_the_board(mean) < 0.8 * of_a_block);
    assert!(seconds_on_the_board(most) < 0.8 * QUEUED_BLOCKS * of_a_block);
}

/// Number of blocks in the queue of the real board.
const QUEUED_BLOCKS: f64 = 16.0;

/// Duration on the real board, which runs at 160 MHz: an instruction takes about 1.5 cycles, including waits for flash and
/// floating point.
fn seconds_on_the_board(instructions: f64) -> f64 {
    1.5 * instructions / 160e6
}

#[test]
fn no_request_of_an_upload_takes_longer_than_blocks_can_wait() {
    let memory = Memory::erased();
    let mut emulator = Emulator::start_counting(&memory);
    let (mut client, info) = connect(&emulator);
    let bytes = table("long", 1.5, 1500);
    upload(&mut client, &bytes);
    let cost = emulator.cost();
    println!(
        "{} bytes: a request takes {:.0} instructions, and {:.1} ms of the flash, at most",
        bytes.len(),
        cost.request_instructions(),
        1e3 * cost.flash_s
    );
    // A request erases at most one page, which takes 22.02 ms, at most 24.47 ms; writing the words of a chunk adds to it.
    assert!((22e-3..26e-3).contains(&cost.flash_s));
    // The longest request checks every byte of the table, so its duration grows with the length of the table.
    let largest = f64::from(info.slot_capacity) / bytes.len() as f64;
    let at_most_s = seconds_on_the_board(largest * cost.request_instructions());
    println!("the largest table is checked in {:.1} ms", 1e3 * at_most_s);
    let wait_s = 0.8 * QUEUED_BLOCKS * 64.0 / 26_667.0;
    // The request that checks the table erases no page.
    assert!(at_most_s < wait_s && cost.flash_s * 24.47 / 22.02 < wait_s);
}

#[test]
fn counts_instructions() {
    assert_eq!(
        emulator::count_instructions(),
        emulator::count_instructions(),
        "a count must repeat"
    );
}
