//! Properties of the tests of a plan.

/// Means: properties of the possible tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Means {
    /// Width of the interval to which cuts bracket a limit, relative to the limit.
    pub bracket: f64,
    /// Standard deviation of a measured chatter frequency, relative to the frequency.
    pub chatter_frequency: f64,
    /// Number of impacts of a hammer test.
    pub blows: usize,
    /// Peak force of an impact, N.
    pub peak_n: f64,
    /// Noise density of the accelerometer, g/√Hz.
    pub accelerometer_g_per_root_hertz: f64,
    /// Relative standard deviation of the gain of hammer and accelerometer, and of the gain of the dynamometer.
    pub calibration: f64,
    /// Noise density of the dynamometer, N/√Hz.
    pub dynamometer_n_per_root_hertz: f64,
    /// Duration of the force recording of a cut, s.
    pub seconds: f64,
    /// Relative standard deviation of the difference of a natural frequency between standstill and cutting.
    pub standstill_frequency: f64,
    /// Relative standard deviation of the difference of a damping ratio between standstill and cutting.
    pub standstill_damping: f64,
}

impl Default for Means {
    /// A 500 N hammer and an accelerometer of 75 µg/√Hz; sensors calibrated to 2 %, brackets of 5 %.
    fn default() -> Self {
        Self {
            bracket: 0.05,
            chatter_frequency: 0.002,
            blows: 5,
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
