//! The real board: NUCLEO-G474RE, an STM32G474RE at 160 MHz, with an IIS3DWB on connector CN7.
//!
//! | pin | connector | what |
//! |---|---|---|
//! | PC10 | CN7-1 | SPI3 SCK to the sensor, 10 MHz |
//! | PC11 | CN7-2 | SPI3 MISO |
//! | PC12 | CN7-3 | SPI3 MOSI |
//! | PD2 | CN7-4 | chip select |
//! | PA1 | CN7-30 | pin INT1 of the sensor: its watermark line, TIM2 channel 2 |
//! | PA0 | CN7-28 | tachometer, rising edge, 3.3 V, TIM2 channel 1 |
//! | PA2, PA3 | ST-LINK | LPUART1 TX and RX: the link to the host, 921 600 baud, 8N1 |
//! | SWD | ST-LINK | log of defmt over RTT |
//!
//! Priorities, highest first: captures of the timer; port and DMA of the link; the tasks for sensor and link, in an
//! interrupt executor; the device, in the main executor.
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

mod event_timer;
mod link_line;
mod sensor;
mod table_flash;
mod work;

use cortex_m_rt::exception;
use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, SpawnError, SpawnToken, Spawner};
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, Uart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, dma, interrupt, peripherals};
use embassy_time::{Delay, Duration, with_timeout};
use embedded_hal_bus::spi::ExclusiveDevice;
use heapless::Vec;
use quietcut_core::acceleration::{Block, Sensor};
use quietcut_core::monitor::State;
use quietcut_core::protocol::message::MAX_BLOCK_EDGES;
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;
use quietcut_firmware::accelerometer::iis3dwb::{Configuration, Iis3dwb};
use quietcut_firmware::defaults;
use quietcut_firmware::device::{Clock, Device, Identity};
use static_cell::{ConstStaticCell, StaticCell};

use crate::event_timer::EDGES;
use crate::link_line::LinkLine;
use crate::sensor::{BLOCKS, MAX_BLOCKS};
use crate::table_flash::TableFlash;
use crate::work::WORK;

bind_interrupts!(struct Irqs {
    LPUART1 => usart::InterruptHandler<peripherals::LPUART1>;
    DMA1_CHANNEL1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
});

const IDENTITY: Identity = Identity {
    board: "nucleo-g474re",
    sensor: Some(Sensor::IIS3DWB_16G),
};
const LINK_BAUD: u32 = 921_600;
const SENSOR_BUS: Hertz = Hertz(10_000_000);
const WATCHDOG_MICROSECONDS: u32 = 2_000_000;
/// Longest sleep of the main loop if no event wakes it.
const LONGEST_SLEEP: Duration = Duration::from_millis(500);

static IO_EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Memory for the state of the signal chain, which the device resets. A value with all bits zero takes no space in the
/// program image.
static STATE: ConstStaticCell<State> = ConstStaticCell::new(NO_BITS);

// SAFETY: the compiler refuses a constant whose bits are not a valid value of its type.
const NO_BITS: State = unsafe { core::mem::zeroed() };

/// The interrupt of the unused port UART4, in which the tasks for sensor and link run.
#[interrupt]
unsafe fn UART4() {
    // SAFETY: this is the interrupt that the executor was started with.
    unsafe { IO_EXECUTOR.on_interrupt() }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_stm32::init(clocks());
    let mut watchdog = IndependentWatchdog::new(board.IWDG, WATCHDOG_MICROSECONDS);
    watchdog.unleash();
    interrupt::TIM2.set_priority(Priority::P1);
    interrupt::LPUART1.set_priority(Priority::P2);
    interrupt::DMA1_CHANNEL1.set_priority(Priority::P2);
    interrupt::DMA1_CHANNEL2.set_priority(Priority::P2);
    interrupt::UART4.set_priority(Priority::P6);
    event_timer::start(board.TIM2, board.PA0, board.PA1);

    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    config.frequency = SENSOR_BUS;
    let bus = Spi::new_blocking(board.SPI3, board.PC10, board.PC12, board.PC11, config);
    let select = Output::new(board.PD2, Level::High, Speed::VeryHigh);
    let Ok(bus) = ExclusiveDevice::new(bus, select, Delay);
    let sensor = Iis3dwb::new(bus, Delay, Configuration::default());

    let mut config = usart::Config::default();
    config.baudrate = LINK_BAUD;
    let port = Uart::new(
        board.LPUART1,
        board.PA3,
        board.PA2,
        board.DMA1_CH1,
        board.DMA1_CH2,
        Irqs,
        config,
    );
    let Ok(port) = port else {
        defmt::panic!("the link cannot run at {=u32} baud", LINK_BAUD)
    };
    let (sender, receiver) = port.split();
    static RING: StaticCell<[u8; 1024]> = StaticCell::new();
    let receiver = receiver.into_ring_buffered(RING.init([0; 1024]));

    let io = IO_EXECUTOR.start(interrupt::UART4);
    io.spawn(first(sensor::read(sensor)));
    io.spawn(first(link_line::receive(receiver)));
    io.spawn(first(link_line::send(sender)));

    let settings = defaults::settings(Sensor::IIS3DWB_16G);
    let tables = TableFlash::new(Flash::new_blocking(board.FLASH));
    let Ok(mut device) = Device::new(IDENTITY, settings, STATE.take(), tables, BoardClock) else {
        defmt::panic!("the settings of this board cannot be")
    };
    defmt::info!("quietcut on NUCLEO-G474RE");
    let mut edges = BlockEdges::default();
    loop {
        // Waiting blocks of samples are processed before a request of the host, which may erase a flash page. Their
        // number is limited, so that requests are done even if the signal chain is too slow for the samples.
        for _ in 0..2 * MAX_BLOCKS {
            let Ok(block) = BLOCKS.try_receive() else { break };
            device.take(&block, edges.until_the_end_of(&block));
            let Ok(()) = device.flush(&mut LinkLine);
            watchdog.pet();
        }
        let Ok(is_busy) = device.poll(&mut LinkLine);
        watchdog.pet();
        // Reads the timer at least once per half of its period, so that its count can be extended beyond 32 bits.
        event_timer::now();
        if !is_busy {
            // That no event came is no error: the main loop then runs once without one.
            let _ = with_timeout(LONGEST_SLEEP, WORK.wait()).await;
        }
    }
}

/// Returns the first instance of a task; panics if the task has an instance already.
fn first<S>(task: Result<SpawnToken<S>, SpawnError>) -> SpawnToken<S> {
    match task {
        Ok(task) => task,
        Err(_) => defmt::panic!("a task was made twice"),
    }
}

/// Assigns the tachometer edges to the blocks of samples.
#[derive(Default)]
struct BlockEdges {
    edges: Vec<Edge, MAX_BLOCK_EDGES>,
    /// A tachometer edge that lies after the end of the newest block and belongs to a later one; `None` if there is
    /// none.
    ahead: Option<Edge>,
}

impl BlockEdges {
    /// The tachometer edges not yet given to a block, up to the end of `block` at the nominal sample rate, oldest
    /// first; at most [`MAX_BLOCK_EDGES`], the others go to later blocks.
    fn until_the_end_of(&mut self, block: &Block) -> &[Edge] {
        let period_ns = (1e9 / Sensor::IIS3DWB_16G.nominal_rate.0) as u64;
        let end = Nanoseconds(block.time.0 + block.counts.len() as u64 * period_ns);
        self.edges.clear();
        while !self.edges.is_full() {
            let Some(edge) = self.ahead.take().or_else(|| EDGES.try_receive().ok()) else {
                break;
            };
            if edge.time > end {
                self.ahead = Some(edge);
                break;
            }
            // The push cannot fail: the loop ends when the list of edges is full.
            let _ = self.edges.push(edge);
        }
        &self.edges
    }
}

/// The clock of the board, from which the device takes the time.
struct BoardClock;

impl Clock for BoardClock {
    fn now(&self) -> Nanoseconds {
        event_timer::now()
    }
}

/// Core clock of 160 MHz from the board's 24 MHz crystal: a divider of 16 then gives exactly the sensor bus's maximum
/// of 10 MHz.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(24_000_000),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL80,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.boost = true;
    config
}

/// Handler of the interrupt that reading a lobe table raises if a loss of power has damaged it: returns and lets the
/// read continue. Panics if the interrupt has another cause.
// SAFETY: the handler touches a flag of the flash memory only.
#[exception]
unsafe fn NonMaskableInt() {
    if !table_flash::pass_over_damage() {
        defmt::panic!("an interrupt that cannot be turned off, of unknown cause");
    }
}

/// Logs the panic message and resets the board.
#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    cortex_m::peripheral::SCB::sys_reset()
}
