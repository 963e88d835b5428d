//! A model of the IIS3DWB with its registers and a clock, from the data sheet and AN5444. It shares no code with the
//! driver.
//!
//! Bus transfers and delays advance the model's clock, so that new samples arrive while the driver reads.

use core::convert::Infallible;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use quietcut_core::acceleration::Counts;

/// Time of one byte on the modelled SPI bus at 10 MHz.
const BYTE_NS: u64 = 800;
/// Time between two SPI transfers: chip select off and on, and the driver's code.
const SELECT_NS: u64 = 2_000;
const RESET_NS: u64 = 50_000;
/// Time after power-on during which the sensor does not answer.
const BOOT_NS: u64 = 10_000_000;
/// Time after the start of sampling during which the sensor's filter has not settled.
const SETTLING_NS: u64 = 10_000_000;
const QUEUE_WORDS: usize = 512;

/// Sample that the model gives before its filter has settled.
pub(crate) const UNSETTLED: Counts = [i16::MAX; 3];

/// The modelled sensor with its clock.
pub(crate) struct Model {
    /// Time since power-on.
    pub(crate) now_ns: u64,
    /// True sample period of the modelled sensor, which may differ from the nominal one.
    pub(crate) period_ns: f64,
    registers: [u8; 128],
    queue: VecDeque<[u8; 7]>,
    shown: [u8; 7],
    overrun_latched: bool,
    reset_ends_ns: Option<u64>,
    /// Time at which the model last started to sample; `None` while sampling is off.
    on_since_ns: Option<u64>,
    /// Number of samples taken since the model last started to sample.
    taken: u64,
    /// Times at which pin INT1 of the modelled sensor rose, oldest first.
    pub(crate) rises_ns: Vec<u64>,
    line: bool,
    /// Times of all settled samples that went to the modelled queue. The counts x, y, z of such a sample encode its
    /// index in this list.
    pub(crate) queued_ns: Vec<u64>,
    fault: Fault,
}

/// Simulated fault of the sensor.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    None,
    /// The identity register of the modelled sensor has this other value.
    Identity(u8),
    /// The reset never ends.
    ResetHangs,
    /// Writes to the sensor register with this address have no effect.
    WritesIgnored(u8),
    /// In every tag that the modelled sensor sends, this bit is inverted.
    TagBit(u8),
}

impl Model {
    pub(crate) fn new(period_ns: f64) -> Rc<RefCell<Self>> {
        let mut model = Self {
            now_ns: 0,
            period_ns,
            registers: [0; 128],
            queue: VecDeque::new(),
            shown: [0; 7],
            overrun_latched: false,
            reset_ends_ns: None,
            on_since_ns: None,
            taken: 0,
            rises_ns: Vec::new(),
            line: false,
            queued_ns: Vec::new(),
            fault: Fault::None,
        };
        model.set_defaults();
        Rc::new(RefCell::new(model))
    }

    /// The counts x, y, z of the settled sample with this index: `index` modulo 30 000, the negative of that, and
    /// the whole part of `index` / 30 000.
    pub(crate) fn counts(index: u64) -> Counts {
        let low = (index % 30_000) as i16;
        [low, -low, (index / 30_000) as i16]
    }

    /// Level of pin INT1.
    pub(crate) fn line(&self) -> bool {
        self.line
    }

    pub(crate) fn level(&self) -> usize {
        self.queue.len()
    }

    pub(crate) fn register(&self, address: u8) -> u8 {
        self.registers[usize::from(address)]
    }

    /// Sets a fault of the modelled sensor. Resets the sensor's registers, which stops the sampling, and empties the
    /// sensor's queue.
    pub(crate) fn break_with(&mut self, fault: Fault) {
        self.fault = fault;
        self.set_defaults();
    }

    /// Inverts this bit of every tag that the modelled sensor sends after this call.
    pub(crate) fn break_tags(&mut self, bit: u8) {
        self.fault = Fault::TagBit(bit);
    }

    pub(crate) fn set_temperature(&mut self, counts: i16) {
        [self.registers[0x20], self.registers[0x21]] = counts.to_le_bytes();
    }

    fn set_defaults(&mut self) {
        self.registers = [0; 128];
        self.registers[0x02] = 0b0011_1111;
        self.registers[0x0f] = match self.fault {
            Fault::Identity(other) => other,
            _ => 0x7b,
        };
        self.registers[0x12] = 0b0000_0100;
        self.queue.clear();
        self.overrun_latched = false;
        self.on_since_ns = None;
        self.update_line();
    }

    pub(crate) fn run_until(&mut self, until_ns: u64) {
        if let Some(ends) = self.reset_ends_ns
            && ends <= until_ns
            && self.fault != Fault::ResetHangs
        {
            self.reset_ends_ns = None;
            self.set_defaults();
        }
        while let Some(on_since) = self.on_since_ns {
            let next = on_since + ((self.taken + 1) as f64 * self.period_ns) as u64;
            if next > until_ns {
                break;
            }
            self.now_ns = next;
            self.taken += 1;
            self.sample(next - on_since >= SETTLING_NS);
        }
        self.now_ns = until_ns;
    }

    fn run(&mut self, ns: u64) {
        self.run_until(self.now_ns + ns);
    }

    fn sample(&mut self, settled: bool) {
        let continuous = self.registers[0x0a] & 0b111 == 0b110;
        let batched = self.registers[0x09] & 0b1111 == 0b1010;
        if !(continuous && batched) {
            return;
        }
        let counts = if settled {
            self.queued_ns.push(self.now_ns);
            Self::counts(self.queued_ns.len() as u64 - 1)
        } else {
            UNSETTLED
        };
        let mut tag = 0x02 << 3 | ((self.taken % 4) as u8) << 1;
        tag |= (tag.count_ones() % 2) as u8;
        let [x, y, z] = counts.map(i16::to_le_bytes);
        if self.queue.len() == QUEUE_WORDS {
            self.queue.pop_front();
            self.overrun_latched = true;
        }
        self.queue.push_back([tag, x[0], x[1], y[0], y[1], z[0], z[1]]);
        self.update_line();
    }

    fn watermark(&self) -> usize {
        usize::from(self.registers[0x07]) | usize::from(self.registers[0x08] & 1) << 8
    }

    fn update_line(&mut self) {
        let routed = self.registers[0x0d] & 0b1000 != 0;
        let line = routed && self.watermark() > 0 && self.queue.len() >= self.watermark();
        if line && !self.line {
            self.rises_ns.push(self.now_ns);
        }
        self.line = line;
    }

    fn read(&mut self, address: u8) -> u8 {
        match address {
            0x12 => self.registers[0x12] | u8::from(self.reset_ends_ns.is_some()),
            0x3a => self.queue.len() as u8,
            0x3b => {
                let level = self.queue.len();
                let flags = u8::from(self.line) << 7 | u8::from(level == QUEUE_WORDS) << 5;
                let latched = u8::from(core::mem::take(&mut self.overrun_latched)) << 3;
                flags | latched | (level >> 8) as u8
            }
            0x78 => {
                self.shown = self.queue.pop_front().unwrap_or_default();
                self.update_line();
                let [tag, ..] = self.shown;
                match self.fault {
                    Fault::TagBit(bit) => tag ^ 1 << bit,
                    _ => tag,
                }
            }
            0x79..=0x7e => self.shown[usize::from(address - 0x78)],
            _ => self.registers[usize::from(address)],
        }
    }

    fn write(&mut self, address: u8, value: u8) {
        assert!(
            self.reset_ends_ns.is_none(),
            "register {address:#04x} is written during a reset"
        );
        // For each register that the driver may write, the bits that the data sheet defines. A written value must
        // keep all other bits at zero.
        let may = match address {
            0x07 => 0xff,
            0x08 => 0b1000_0001,
            0x09 => 0b0000_1111,
            0x0a => 0b1111_0111,
            0x0d => 0b0111_1101,
            0x10 => 0b1110_1110,
            0x12 => 0b1111_1101,
            0x13 => 0b0010_1101 | 0b100,
            0x15 => 0b0000_1011,
            0x17 => 0b1111_1100,
            _ => panic!("register {address:#04x} must not be written"),
        };
        assert_eq!(value & !may, 0, "reserved bits of register {address:#04x}");
        if self.fault == Fault::WritesIgnored(address) {
            return;
        }
        match address {
            0x0a if value & 0b111 == 0 => self.queue.clear(),
            0x10 => {
                let on = value >> 5;
                assert!(on == 0 || on == 0b101, "no such rate: {on:#b}");
                if on == 0 {
                    self.on_since_ns = None;
                } else if self.on_since_ns.is_none() {
                    self.on_since_ns = Some(self.now_ns);
                    self.taken = 0;
                }
            }
            0x12 if value & 1 != 0 => self.reset_ends_ns = Some(self.now_ns + RESET_NS),
            _ => {}
        }
        self.registers[usize::from(address)] = if address == 0x12 { value & !1 } else { value };
        self.update_line();
    }

    /// The register address of the next byte in an SPI transfer after `address`. It stays the same if the sensor is
    /// not set to count addresses up. From the last output byte of the queue it wraps to the tag.
    fn next(&self, address: u8) -> u8 {
        let counts_up = self.registers[0x12] & 0b100 != 0;
        match address {
            _ if !counts_up => address,
            0x7e => 0x78,
            other => (other + 1) & 0x7f,
        }
    }
}

/// An SPI bus to which the modelled sensor is connected.
pub(crate) struct Bus(pub(crate) Rc<RefCell<Model>>);

impl ErrorType for Bus {
    type Error = Infallible;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let mut model = self.0.borrow_mut();
        model.run(SELECT_NS);
        let mut address = None;
        let mut reading = false;
        for operation in operations {
            match operation {
                Operation::Write(bytes) => {
                    for &byte in *bytes {
                        model.run(BYTE_NS);
                        match address {
                            None => {
                                address = Some(byte & 0x7f);
                                reading = byte & 0x80 != 0;
                            }
                            Some(at) => {
                                assert!(!reading, "a byte is written in a read");
                                model.write(at, byte);
                                address = Some(model.next(at));
                            }
                        }
                    }
                }
                Operation::Read(bytes) => {
                    for byte in bytes.iter_mut() {
                        let at = address.expect("a transfer begins with an address");
                        assert!(reading, "a byte is read in a write");
                        // The sensor fixes the value of a byte at the beginning of the byte's transfer.
                        *byte = if model.now_ns < BOOT_NS {
                            0xff
                        } else {
                            model.read(at)
                        };
                        model.run(BYTE_NS);
                        address = Some(model.next(at));
                    }
                }
                _ => panic!("not modelled"),
            }
        }
        Ok(())
    }
}

/// A delay that advances the clock of the modelled sensor.
pub(crate) struct Delay(pub(crate) Rc<RefCell<Model>>);

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        self.0.borrow_mut().run(u64::from(ns));
    }
}
