//! The device's clock: timer TIM2, which captures tachometer edges and the sensor's watermark line in hardware.
//!
//! Both inputs pass the same filter, so that both have the same delay. The timer wraps every 54 s. Events and calls
//! of [`now`] extend its count beyond 32 bits.

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

/// Capacity of the queue of tachometer edges: 0.17 s of a wheel with 60 positions at 1 500 rev/min, or about twice the
/// edges at 6 000 rev/min during a page erase of 22 ms.
const MAX_EDGES: usize = 256;

/// Edges of the tachometer, in order of time. If the queue is full, the newest edges are dropped.
pub(crate) static EDGES: Queue<CriticalSectionRawMutex, Edge, MAX_EDGES> = Queue::new();

/// Time of the last rise of the sensor's watermark line, until it is taken or discarded.
pub(crate) static RISE: Signal<CriticalSectionRawMutex, Nanoseconds> = Signal::new();

static TIMER: Mutex<RefCell<Option<Timer<'static, TIM2>>>> = Mutex::new(RefCell::new(None));
/// The newest count of the timer TIM2, extended to 64 bits.
static TICKS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

/// Starts timer TIM2, the device's clock. The pins of the tachometer and of the sensor's watermark line become
/// capture inputs of the timer.
pub(crate) fn start(
    timer: Peri<'static, TIM2>,
    tachometer: Peri<'static, PA0>,
    watermark: Peri<'static, PA1>,
) {
    use embassy_stm32::gpio::Pull;
    // The pull-down resistors only define the level of an unconnected input. The outputs of tachometer and sensor are
    // push-pull.
    core::mem::forget(CapturePin::<TIM2, Ch1>::new(tachometer, Pull::Down));
    core::mem::forget(CapturePin::<TIM2, Ch2>::new(watermark, Pull::Down));

    let mut timer = Timer::new(timer);
    timer.set_tick_freq(Hertz(TICKS_PER_SECOND));
    timer.set_max_compare_value(u32::MAX);
    for channel in [TACHOMETER, WATERMARK] {
        timer.set_input_ti_selection(channel, InputTISelection::Normal);
        // Input filter: eight equal samples at a quarter of 160 MHz. Pulses shorter than 0.175 µs are suppressed.
        timer.set_input_capture_filter(channel, FilterValue::FDTS_DIV4_N8);
        timer.set_input_capture_mode(channel, InputCaptureMode::Rising);
        timer.set_input_capture_prescaler(channel, 0);
        timer.enable_channel(channel, true);
        timer.enable_input_interrupt(channel, true);
    }
    timer.generate_update_event();
    timer.start();
    critical_section::with(|token| TIMER.borrow_ref_mut(token).replace(timer));
    // SAFETY: the interrupt handler shares data with the rest of the program through mutexes only.
    unsafe { interrupt::TIM2.enable() };
}

/// The present time on the device's clock.
pub(crate) fn now() -> Nanoseconds {
    critical_section::with(|token| {
        let count = match &*TIMER.borrow_ref(token) {
            Some(timer) => timer.regs_gp32().cnt().read(),
            None => 0,
        };
        carry_on(token, count)
    })
}

/// The time that belongs to a timer count, which is at most half a period of the timer from the newest count. Updates
/// the newest count.
fn carry_on(token: CriticalSection<'_>, count: u32) -> Nanoseconds {
    let newest = TICKS.borrow(token).get();
    // The captures of both inputs, served in one interrupt, may be out of order, so the difference is signed.
    let difference = count.wrapping_sub(newest as u32).cast_signed();
    let ticks = newest.saturating_add_signed(i64::from(difference));
    TICKS.borrow(token).set(newest.max(ticks));
    // One tick is 12.5 ns.
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
