//! The real board: NUCLEO-G474RE, an STM32G474RE at 160 MHz.
//!
//! | pin | connector | what |
//! |---|---|---|
//! | PA2, PA3 | ST-LINK | LPUART1 TX and RX: the link to the host, 921 600 baud, 8N1 |
//! | SWD | ST-LINK | log of defmt over RTT |
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, peripherals};
use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read, Write};
use static_cell::StaticCell;

bind_interrupts!(struct Irqs {
    LPUART1 => usart::BufferedInterruptHandler<peripherals::LPUART1>;
});

const LINK_BAUD: u32 = 921_600;
const WATCHDOG_MICROSECONDS: u32 = 2_000_000;

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_stm32::init(clocks());
    defmt::info!("quietcut on NUCLEO-G474RE");
    let mut watchdog = IndependentWatchdog::new(board.IWDG, WATCHDOG_MICROSECONDS);
    watchdog.unleash();

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

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    cortex_m::peripheral::SCB::sys_reset()
}
