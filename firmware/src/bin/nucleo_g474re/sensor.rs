//! The task that reads the accelerometer and queues blocks of samples for the device.

use core::convert::Infallible;

use embassy_stm32::gpio::Output;
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::spi::{Spi, mode::Master};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Delay, Duration, Timer, with_timeout};
use embedded_hal_bus::spi::ExclusiveDevice;
use quietcut_core::acceleration::Block;
use quietcut_firmware::accelerometer::Accelerometer;
use quietcut_firmware::accelerometer::iis3dwb::Iis3dwb;
use quietcut_firmware::acquisition::Acquisition;

use crate::event_timer::{self, RISE};
use crate::work::WORK;

/// The board's accelerometer.
pub(crate) type Sensor =
    Iis3dwb<ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, Delay>, Delay>;

/// Capacity of the queue of sample blocks: 38 ms of blocks, for the duration of a page erase or of the check of a
/// lobe table. A test in the emulator asserts that no request of a table upload takes longer.
pub(crate) const MAX_BLOCKS: usize = 16;

/// Longest wait for the watermark line, which rises every 2.4 ms. If the line is not connected, the sensor's queue is
/// read after this wait; the queue is full after 19 ms.
const LINE_TIMEOUT: Duration = Duration::from_millis(10);
const RETRY: Duration = Duration::from_secs(1);

/// Blocks of samples, in order. If the queue is full, the newest blocks are dropped.
pub(crate) static BLOCKS: Channel<CriticalSectionRawMutex, Block, MAX_BLOCKS> = Channel::new();

/// The reason why the accelerometer is restarted.
#[derive(defmt::Format)]
enum Failure {
    /// The driver returned an error.
    Driver(<Sensor as Accelerometer>::Error),
    /// The sensor gave no samples.
    Silent,
}

/// Task that starts the accelerometer, reads it, and restarts it after an error.
#[embassy_executor::task]
pub(crate) async fn read(sensor: Sensor) {
    let mut acquisition = Acquisition::new(sensor);
    loop {
        if let Err(error) = acquisition.start() {
            defmt::error!("sensor: {}", error);
            Timer::after(RETRY).await;
            continue;
        }
        RISE.reset();
        defmt::info!("sensor: started");
        let Err(failure) = read_blocks(&mut acquisition).await;
        defmt::error!("sensor: {}", failure);
    }
}

/// Reads sample blocks from the accelerometer and queues them, until the accelerometer fails.
async fn read_blocks(acquisition: &mut Acquisition<Sensor>) -> Result<Infallible, Failure> {
    loop {
        // While the watermark line is high it cannot rise: the sensor's queue already holds as many samples as the
        // watermark.
        let rise = if watermark_is_reached() || acquisition.is_behind() {
            RISE.try_take()
        } else {
            with_timeout(LINE_TIMEOUT, RISE.wait()).await.ok()
        };
        let block = acquisition
            .read(rise, event_timer::now())
            .map_err(Failure::Driver)?
            .ok_or(Failure::Silent)?;
        if BLOCKS.try_send(block.clone()).is_err() {
            defmt::warn!(
                "block {=u32} is dropped: the pipeline is too slow",
                block.sequence
            );
        }
        WORK.signal(());
        // Discards a rise of the watermark line during the read, which belongs to no known sample.
        RISE.reset();
    }
}

/// True while the watermark line is high: the sensor's queue holds at least as many samples as the watermark.
fn watermark_is_reached() -> bool {
    pac::GPIOA.idr().read().idr(1) == pac::gpio::vals::Idr::HIGH
}
