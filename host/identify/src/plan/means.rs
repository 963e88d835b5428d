//! Properties of the tests that a plan may contain: sensors, impacts of a hammer, brackets of limits, and recordings.

/// Properties of the tests that a plan may contain, and of their sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct Means {
    /// Final width of the interval of depth to which cuts bracket a stability limit, relative to the limit.
    pub bracket: f64,
    /// Standard deviation of a measured chatter frequency, relative to the frequency.
    pub chatter_frequency: f64,
    /// Number of impacts of a hammer test in one direction.
    pub impacts: usize,
    /// Peak force of an impact, N.
    pub peak_n: f64,
    /// Noise density of the accelerometer of a hammer test, g/√Hz.
    pub accelerometer_g_per_root_hertz: f64,
    /// Relative standard deviation of the common gain of hammer and accelerometer, and of the gain of the dynamometer.
    pub calibration: f64,
    /// Noise density of the force of the dynamometer, N/√Hz.
    pub dynamometer_n_per_root_hertz: f64,
    /// Duration of the force recording of a cut, s.
    pub seconds: f64,
    /// Standard deviation of the difference between a natural frequency at standstill and during cutting, relative to
    /// the frequency.
    pub standstill_frequency: f64,
    /// Standard deviation of the difference between a damping ratio at standstill and during cutting, relative to the
    /// ratio.
    pub standstill_damping: f64,
}

impl Default for Means {
    /// Default tests: impacts of 500 N, an accelerometer of 75 µg/√Hz, sensors calibrated to 2 %, and brackets of 5 %
    /// of the limit.
    fn default() -> Self {
        Self {
            bracket: 0.05,
            chatter_frequency: 0.002,
            impacts: 5,
            peak_n: 500.0,
            accelerometer_g_per_root_hertz: 75e-6,
            calibration: 0.02,
            dynamometer_n_per_root_hertz: 0.1,
            seconds: 2.0,
            standstill_frequency: 0.005,
            standstill_damping: 0.1,
        }
    }
}
