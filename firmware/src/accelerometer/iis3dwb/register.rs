//! Addresses of the sensor's registers.

pub(crate) const FIFO_CTRL1: u8 = 0x07;
pub(crate) const FIFO_CTRL2: u8 = 0x08;
pub(crate) const FIFO_CTRL3: u8 = 0x09;
pub(crate) const FIFO_CTRL4: u8 = 0x0a;
pub(crate) const INT1_CTRL: u8 = 0x0d;
pub(crate) const WHO_AM_I: u8 = 0x0f;
pub(crate) const CTRL1_XL: u8 = 0x10;
pub(crate) const CTRL3_C: u8 = 0x12;
pub(crate) const CTRL4_C: u8 = 0x13;
pub(crate) const CTRL6_C: u8 = 0x15;
pub(crate) const CTRL8_XL: u8 = 0x17;
pub(crate) const OUT_TEMP_L: u8 = 0x20;
pub(crate) const FIFO_STATUS1: u8 = 0x3a;
pub(crate) const FIFO_DATA_OUT_TAG: u8 = 0x78;
