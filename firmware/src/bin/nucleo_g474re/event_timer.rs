//! The device's clock, TIM2, which catches tachometer edges and the sensor's watermark line in hardware.
//!
//! Both inputs pass the same filter, so that both are late by the same time. The timer comes round
//! every 53 s; events and calls of [`now`] in between carry its count on.

use core::cell::{Cell, RefCell};

use critical_section::{CriticalSection, Mutex};
use embassy_stm32::Peri;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::peripherals::{PA0, PA1, TIM2};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::input_capture::{CapturePin, Ch1, Ch2};
use embassy_stm32::timer::low_level::{FilterValue, InputCaptureMode, InputTISelection, Timer};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel as Queue;
use embassy_sync::signal::Signal;
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;

const TICKS_PER_SECOND: u32 = 80_000_000;
const TACHOMETER: Channel = Channel::Ch1;
const WATERMARK: Channel = Channel::Ch2;

/// Edges that wait to be taken: 0.1 s of a wheel of 60 at 1 500 rev/min, twice what comes while a page
/// of flash is erased at 6 000.
const MAX_EDGES: usize = 256;

/// Edges of the tachometer, in the order of their time; the newest are dropped where nobody takes them.
pub(crate) static EDGES: Queue<CriticalSectionRawMutex, Edge, MAX_EDGES> = Queue::new();

/// When the sensor's watermark line last rose.
pub(crate) static RISE: Signal<CriticalSectionRawMutex, Nanoseconds> = Signal::new();

static TIMER: Mutex<RefCell<Option<Timer<'static, TIM2>>>> = Mutex::new(RefCell::new(None));
/// The count of the timer at its newest reading, carried on beyond 32 bits.
static TICKS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

/// Starts the clock. The pins stay inputs of the timer for good.
pub(crate) fn start(
    timer: Peri<'static, TIM2>,
    tachometer: Peri<'static, PA0>,
    watermark: Peri<'static, PA1>,
) {
    use embassy_stm32::gpio::Pull;
    // The tachometer drives both ways; the pull only keeps an open input quiet.
    core::mem::forget(CapturePin::<TIM2, Ch1>::new(tachometer, Pull::Down));
    core::mem::forget(CapturePin::<TIM2, Ch2>::new(watermark, Pull::Down));

    let mut timer = Timer::new(timer);
    timer.set_tick_freq(Hertz(TICKS_PER_SECOND));
    timer.set_max_compare_value(u32::MAX);
    for channel in [TACHOMETER, WATERMARK] {
        timer.set_input_ti_selection(channel, InputTISelection::Normal);
        // Eight samples alike at a quarter of 160 MHz: shorter than 0.2 µs is a disturbance.
        timer.set_input_capture_filter(channel, FilterValue::FDTS_DIV4_N8);
        timer.set_input_capture_mode(channel, InputCaptureMode::Rising);
        timer.set_input_capture_prescaler(channel, 0);
        timer.enable_channel(channel, true);
        timer.enable_input_interrupt(channel, true);
    }
    timer.generate_update_event();
    timer.start();
    critical_section::with(|token| TIMER.borrow_ref_mut(token).replace(timer));
    // SAFETY: the handler shares data with the rest of the program through mutexes only.
    unsafe { interrupt::TIM2.enable() };
}

/// The time on the device's clock.
pub(crate) fn now() -> Nanoseconds {
    critical_section::with(|token| {
        let count = match &*TIMER.borrow_ref(token) {
            Some(timer) => timer.regs_gp32().cnt().read(),
            None => 0,
        };
        carry_on(token, count)
    })
}

/// The time of a count of the timer that is at most half a round away from the newest one.
fn carry_on(token: CriticalSection<'_>, count: u32) -> Nanoseconds {
    let newest = TICKS.borrow(token).get();
    // Two events of one interrupt may be out of order: the difference has a sign.
    let difference = count.wrapping_sub(newest as u32).cast_signed();
    let ticks = newest.saturating_add_signed(i64::from(difference));
    TICKS.borrow(token).set(newest.max(ticks));
    // 12.5 ns each.
    Nanoseconds(ticks * 25 / 2)
}

#[interrupt]
fn TIM2() {
    critical_section::with(|token| {
        let timer = TIMER.borrow_ref(token);
        let Some(timer) = &*timer else { return };
        if timer.get_input_interrupt(TACHOMETER) {
            timer.clear_input_interrupt(TACHOMETER);
            let time = carry_on(token, timer.get_capture_value(TACHOMETER));
            if EDGES.try_send(Edge { time }).is_err() {
                defmt::warn!("a tachometer edge is dropped: nobody takes them");
            }
        }
        if timer.get_input_interrupt(WATERMARK) {
            timer.clear_input_interrupt(WATERMARK);
            RISE.signal(carry_on(token, timer.get_capture_value(WATERMARK)));
        }
    });
}
