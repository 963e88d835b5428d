//! Bits of the sensor's registers.

/// Bit of the first byte of an SPI transfer, the register address, that marks a read.
pub(super) const READ: u8 = 0x80;
/// CTRL1_XL: the accelerometer runs at 26.667 kHz; no other rate exists.
pub(super) const XL_ON: u8 = 0b101 << 5;
/// CTRL1_XL: the second low-pass filter is in the signal path.
pub(super) const LPF2_ON: u8 = 1 << 1;
/// CTRL3_C: reset; clears itself.
pub(super) const SW_RESET: u8 = 1;
/// CTRL3_C: the register address counts up within a transfer.
pub(super) const IF_INC: u8 = 1 << 2;
/// CTRL3_C: block data update: both bytes of a value belong to the same sample.
pub(super) const BDU: u8 = 1 << 6;
/// CTRL4_C: the bus pins work as SPI only, not as I²C.
pub(super) const I2C_OFF: u8 = 1 << 2;
/// FIFO_CTRL3: acceleration samples go to the queue at 26.667 kHz.
pub(super) const BATCH_XL: u8 = 0b1010;
/// FIFO_CTRL4: the sample queue is off and empty.
pub(super) const BYPASS: u8 = 0b000;
/// FIFO_CTRL4: when the sample queue is full, new samples overwrite the oldest.
pub(super) const CONTINUOUS: u8 = 0b110;
/// INT1_CTRL: pin INT1 is high while the queue holds as many words as the watermark or more.
pub(super) const INT1_WATERMARK: u8 = 1 << 3;
/// FIFO_STATUS2: the sample queue has overflowed since this register was last read.
pub(super) const OVERRUN_LATCHED: u8 = 1 << 3;
/// FIFO_STATUS2: the two high bits of the queue level.
pub(super) const LEVEL_HIGH: u8 = 0b11;
/// Code in the top five bits of the tag that marks a word of the queue as acceleration.
pub(super) const TAG_XL: u8 = 0x02;
