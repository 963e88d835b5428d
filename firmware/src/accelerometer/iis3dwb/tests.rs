//! The driver of the sensor, tested with a model of its registers.

use std::cell::RefCell;
use std::rc::Rc;

use super::*;
use crate::accelerometer::iis3dwb_model::{Bus, Delay, Fault, Model, UNSETTLED};

const NOMINAL_PERIOD_NS: f64 = 1e9 / 26_667.0;

type Samples = Vec<Counts, MAX_BLOCK_SAMPLES>;

fn driver(model: &Rc<RefCell<Model>>, configuration: Configuration) -> Iis3dwb<Bus, Delay> {
    Iis3dwb::new(Bus(model.clone()), Delay(model.clone()), configuration)
}

fn wait(model: &Rc<RefCell<Model>>, ns: u64) {
    let until = model.borrow().now_ns + ns;
    model.borrow_mut().run_until(until);
}

#[test]
fn start_leaves_the_registers_that_the_data_sheet_asks_for() {
    for (range, code, micro_g) in [
        (Range::G2, 0b00, 61.0),
        (Range::G4, 0b10, 122.0),
        (Range::G8, 0b11, 244.0),
        (Range::G16, 0b01, 488.0),
    ] {
        let model = Model::new(NOMINAL_PERIOD_NS);
        let configuration = Configuration {
            range,
            filter: Filter::LowPass(Divisor::By45),
            watermark: 300,
        };
        let mut sensor = driver(&model, configuration);
        sensor.start().unwrap();
        let model = model.borrow();
        assert_eq!(model.register(0x10), 0b1010_0010 | code << 2, "{range:?}");
        assert_eq!(model.register(0x12), 0b0100_0100);
        assert_eq!(model.register(0x17), 0b0110_0000);
        assert_eq!([model.register(0x07), model.register(0x08)], [44, 1]);
        assert_eq!(model.register(0x09), 0b1010);
        assert_eq!(model.register(0x0a), 0b110);
        assert_eq!(model.register(0x0d), 0b1000);
        let scale = sensor.sensor().meters_per_second2_per_count / 9.806_65 * 1e6;
        // The tolerance is single precision.
        assert!((scale - micro_g).abs() < 1e-3, "{range:?}: {scale}");
    }
}

#[test]
fn start_resets_what_ran_before() {
    let model = Model::new(NOMINAL_PERIOD_NS);
    let other = Configuration {
        range: Range::G2,
        filter: Filter::LowPass(Divisor::By800),
        watermark: 511,
    };
    driver(&model, other).start().unwrap();
    wait(&model, 100_000_000);
    let mut sensor = driver(&model, Configuration::default());
    sensor.start().unwrap();
    assert_eq!(model.borrow().register(0x10), 0b1010_0100);
    assert_eq!(model.borrow().register(0x17), 0);
    let mut samples = Samples::new();
    let queue = sensor.read(&mut samples).unwrap();
    assert_eq!(
        queue,
        Queue {
            level: 0,
            overrun: false,
            gap: None
        }
    );
}

#[test]
fn every_sample_comes_once_in_order_and_settled() {
    let model = Model::new(NOMINAL_PERIOD_NS * 1.03);
    let mut sensor = driver(&model, Configuration::default());
    sensor.start().unwrap();
    let mut samples = Samples::new();
    let mut next = 0;
    // Intervals after which no samples, some, as many as fit, and more than fit are in the queue.
    for turn in 0..2000_u64 {
        wait(&model, turn * 2_654_435_761 % 3_200_000);
        let level = model.borrow().level();
        let queue = sensor.read(&mut samples).unwrap();
        // The status is read within two samples.
        assert!((level..level + 2).contains(&usize::from(queue.level)));
        assert!(!queue.overrun);
        assert!(queue.gap.is_none_or(|gap| gap.remainder == 0), "turn {turn}");
        for &counts in &samples {
            assert_ne!(counts, UNSETTLED);
            assert_eq!(counts, Model::counts(next), "turn {turn}");
            next += 1;
        }
    }
    assert!(next > 80_000, "only {next} samples");
}

#[test]
fn an_overrun_is_reported_once_with_its_gap() {
    let model = Model::new(NOMINAL_PERIOD_NS);
    let mut sensor = driver(&model, Configuration::default());
    sensor.start().unwrap();
    wait(&model, 10_000_000);
    let mut samples = Samples::new();
    sensor.read(&mut samples).unwrap();
    let last = *samples.last().unwrap();
    wait(&model, 30_000_000);
    let queue = sensor.read(&mut samples).unwrap();
    assert!(queue.overrun);
    assert_eq!(queue.level, QUEUE_WORDS);
    let lost = samples[0][0] - last[0] - 1;
    assert!(lost > 0);
    assert_eq!(i16::from(queue.gap.unwrap().remainder), lost % 4);
    let queue = sensor.read(&mut samples).unwrap();
    assert!(!queue.overrun);
    assert_eq!(queue.gap.unwrap().remainder, 0);
}

#[test]
fn the_watermark_line_rises_at_the_watermark() {
    let model = Model::new(NOMINAL_PERIOD_NS);
    let mut sensor = driver(&model, Configuration::default());
    sensor.start().unwrap();
    while !model.borrow().line() {
        wait(&model, 1000);
    }
    assert_eq!(model.borrow().level(), 64);
    sensor.read(&mut Samples::new()).unwrap();
    assert!(!model.borrow().line());
}

#[test]
fn each_fault_has_its_error() {
    let configuration = Configuration::default();
    for (fault, error) in [
        (Fault::Identity(0x6c), Error::WrongIdentity { found: 0x6c }),
        (Fault::Identity(0xff), Error::WrongIdentity { found: 0xff }),
        (Fault::ResetHangs, Error::ResetTimeout),
        (
            Fault::WritesIgnored(0x10),
            Error::NotWritten {
                register: 0x10,
                written: 0b1010_0100,
                found: 0,
            },
        ),
    ] {
        let model = Model::new(NOMINAL_PERIOD_NS);
        model.borrow_mut().break_with(fault);
        assert_eq!(driver(&model, configuration).start(), Err(error));
    }
    for asked in [0, 512, u16::MAX] {
        let model = Model::new(NOMINAL_PERIOD_NS);
        let configuration = Configuration {
            watermark: asked,
            ..configuration
        };
        let error = Error::WatermarkOutOfRange { asked };
        assert_eq!(driver(&model, configuration).start(), Err(error));
    }
}

#[test]
fn any_turned_bit_of_a_tag_is_found() {
    for bit in 0..8 {
        let model = Model::new(NOMINAL_PERIOD_NS);
        let mut sensor = driver(&model, Configuration::default());
        sensor.start().unwrap();
        wait(&model, 1_000_000);
        model.borrow_mut().break_tags(bit);
        let result = sensor.read(&mut Samples::new());
        assert!(
            matches!(result, Err(Error::BadTag { .. })),
            "bit {bit}: {result:?}"
        );
    }
}

#[test]
fn the_bus_error_comes_through() {
    #[derive(Debug, PartialEq)]
    struct Broken;
    impl embedded_hal::spi::Error for Broken {
        fn kind(&self) -> embedded_hal::spi::ErrorKind {
            embedded_hal::spi::ErrorKind::Other
        }
    }
    impl embedded_hal::spi::ErrorType for Broken {
        type Error = Self;
    }
    impl SpiDevice for Broken {
        fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), Self> {
            Err(Broken)
        }
    }
    let model = Model::new(NOMINAL_PERIOD_NS);
    let mut sensor = Iis3dwb::new(Broken, Delay(model), Configuration::default());
    assert_eq!(sensor.start(), Err(Error::Bus(Broken)));
    assert_eq!(sensor.read(&mut Samples::new()), Err(Error::Bus(Broken)));
}

#[test]
fn temperature_counts_from_25_degrees() {
    let model = Model::new(NOMINAL_PERIOD_NS);
    wait(&model, 20_000_000);
    for (counts, celsius) in [(0, 25.0), (256, 26.0), (-2560, 15.0)] {
        model.borrow_mut().set_temperature(counts);
        let mut sensor = driver(&model, Configuration::default());
        assert_eq!(sensor.temperature_celsius(), Ok(celsius));
    }
}
