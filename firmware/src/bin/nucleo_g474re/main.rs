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
//! What runs at which priority, the highest first: the timer's captures; the link's bytes; the reading of the sensor,
//! in an executor of its own; the pipeline and the link's messages, in the main executor.
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

mod event_timer;
mod table_flash;

use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Blocking;
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, interrupt, pac, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Delay, Duration, Timer, with_timeout};
use embedded_hal_bus::spi::ExclusiveDevice;
use embedded_io_async::{Read, Write};
use quietcut_core::acceleration::Block;
use quietcut_firmware::accelerometer::Accelerometer;
use quietcut_firmware::accelerometer::iis3dwb::{Configuration, Iis3dwb};
use quietcut_firmware::acquisition::Acquisition;
use static_cell::StaticCell;

use crate::event_timer::RISE;
use crate::table_flash::TableFlash;

bind_interrupts!(struct Irqs {
    LPUART1 => usart::BufferedInterruptHandler<peripherals::LPUART1>;
});

const LINK_BAUD: u32 = 921_600;
const SENSOR_BUS: Hertz = Hertz(10_000_000);
const WATCHDOG_MICROSECONDS: u32 = 2_000_000;
/// The watermark line rises every 2.4 ms: after this without it something is wrong.
const SENSOR_TIMEOUT: Duration = Duration::from_millis(10);
const SENSOR_RETRY: Duration = Duration::from_secs(1);
/// Blocks that wait while a page of flash is erased (22 ms) or a spectrum is computed.
const MAX_BLOCKS: usize = 16;

type Sensor =
    Iis3dwb<ExclusiveDevice<Spi<'static, Blocking, spi::mode::Master>, Output<'static>, Delay>, Delay>;

static BLOCKS: Channel<CriticalSectionRawMutex, Block, MAX_BLOCKS> = Channel::new();
static SENSOR_EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// The interrupt of a port that is not used runs the executor that reads the sensor.
#[interrupt]
unsafe fn UART4() {
    // SAFETY: this is the interrupt that the executor was started with.
    unsafe { SENSOR_EXECUTOR.on_interrupt() }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_stm32::init(clocks());
    defmt::info!("quietcut on NUCLEO-G474RE");
    let mut watchdog = IndependentWatchdog::new(board.IWDG, WATCHDOG_MICROSECONDS);
    watchdog.unleash();

    interrupt::TIM2.set_priority(Priority::P1);
    interrupt::LPUART1.set_priority(Priority::P2);
    interrupt::UART4.set_priority(Priority::P6);
    event_timer::start(board.TIM2, board.PA0, board.PA1);

    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    config.frequency = SENSOR_BUS;
    let bus = Spi::new_blocking(board.SPI3, board.PC10, board.PC12, board.PC11, config);
    let select = Output::new(board.PD2, Level::High, Speed::VeryHigh);
    // Cannot fail: setting an output has no error.
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay);
    let sensor = Iis3dwb::new(device, Delay, Configuration::default());
    match read_sensor(Acquisition::new(sensor)) {
        Ok(task) => SENSOR_EXECUTOR.start(interrupt::UART4).spawn(task),
        Err(_) => defmt::panic!("the task that reads the sensor runs already"),
    }

    let _tables = TableFlash::new(embassy_stm32::flash::Flash::new_blocking(board.FLASH));

    static SENT: StaticCell<[u8; 4096]> = StaticCell::new();
    static RECEIVED: StaticCell<[u8; 4096]> = StaticCell::new();
    let mut config = usart::Config::default();
    config.baudrate = LINK_BAUD;
    let link = BufferedUart::new(
        board.LPUART1,
        board.PA3,
        board.PA2,
        SENT.init([0; 4096]),
        RECEIVED.init([0; 4096]),
        Irqs,
        config,
    );
    let Ok(mut link) = link else {
        defmt::panic!("the link cannot run at {=u32} baud", LINK_BAUD)
    };
    loop {
        let mut bytes = [0; 64];
        let received = with_timeout(Duration::from_millis(500), link.read(&mut bytes)).await;
        if let Ok(Ok(count)) = received
            && let Some(bytes) = bytes.get(..count)
        {
            // Errors of the port are those of the line: the frame they fall in is dropped by its checksum.
            let _ = link.write_all(bytes).await;
        }
        watchdog.pet();
    }
}

/// Starts the sensor, reads its queue whenever the watermark line rises, and starts it again after an error.
#[embassy_executor::task]
async fn read_sensor(mut acquisition: Acquisition<Sensor>) {
    loop {
        if let Err(error) = acquisition.start() {
            defmt::error!("sensor: {}", error);
            Timer::after(SENSOR_RETRY).await;
            continue;
        }
        RISE.reset();
        defmt::info!("sensor: started");
        let Err(why) = read_blocks(&mut acquisition).await;
        defmt::error!("sensor: {}", why);
    }
}

/// Passes blocks on until the sensor fails.
async fn read_blocks(
    acquisition: &mut Acquisition<Sensor>,
) -> Result<core::convert::Infallible, SensorFailure> {
    loop {
        // While the line is high it cannot rise: more samples are there already.
        let rise = if watermark_is_reached() || acquisition.is_behind() {
            RISE.try_take()
        } else {
            with_timeout(SENSOR_TIMEOUT, RISE.wait()).await.ok()
        };
        let block = acquisition
            .read(rise, event_timer::now())
            .map_err(SensorFailure::Driver)?
            .ok_or(SensorFailure::Silent)?;
        if BLOCKS.try_send(block.clone()).is_err() {
            defmt::warn!(
                "block {=u32} is dropped: the pipeline is too slow",
                block.sequence
            );
        }
        // A rise during the read belongs to no known sample.
        RISE.reset();
    }
}

/// Why the sensor is started again.
#[derive(defmt::Format)]
enum SensorFailure {
    /// The driver found an error.
    Driver(<Sensor as Accelerometer>::Error),
    /// No samples came.
    Silent,
}

/// True while the sensor's queue holds as many samples as the watermark or more.
fn watermark_is_reached() -> bool {
    pac::GPIOA.idr().read().idr(1) == pac::gpio::vals::Idr::HIGH
}

/// 160 MHz from the board's crystal of 24 MHz: the fastest at which a divider of 16 gives the
/// sensor's bus exactly its 10 MHz.
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

/// Says why, and starts anew.
#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    cortex_m::peripheral::SCB::sys_reset()
}
