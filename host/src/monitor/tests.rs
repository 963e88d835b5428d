//! Tests of the state, of the pictures and of the connection.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{Content, Interval, IntervalKind, Layer, Validity, encode, encoded_length};
use quietcut_core::monitor::{Band, Report, Strobe};
use quietcut_core::protocol::{SpectrumChunk, StrobeChunk};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Nanoseconds, Rpm};
use quietcut_core::working_point::WorkingPoint;
use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::choices::{Chart, Choices};
use super::link::{self, News};
use super::lobes::{LobeMap, Margin};
use super::received::{Connection, Identity, Received};
use super::spectrum::Spectrum;
use super::view::{self, palette::Palette};
use crate::device::port::SerialLine;
use crate::device::{Client, DeviceError, Event, Pace, Setup, SimulatedDevice};

fn report(t_ms: u64, verdict: Verdict) -> Report {
    Report {
        sequence: 1,
        time: Nanoseconds(t_ms * 1_000_000),
        speed: Some(Rpm(1045.0)),
        judgement: Judgement {
            verdict,
            reason: Reason::Growing,
            chatter: verdict.is_chatter().then_some(Hertz(17.4)),
            multiplier_abs: None,
            confidence: 0.9,
        },
        alarm: false,
        advice: None,
        clipped: 0,
        lost: 0,
    }
}

fn chunk(first: u16, power: &[f32]) -> SpectrumChunk {
    SpectrumChunk {
        band: Band::Structure,
        sequence: 5,
        bin: Hertz(0.5),
        bins: 192,
        first,
        power: power.iter().copied().collect(),
    }
}

/// A device in chatter, with spectrum and map.
fn in_chatter() -> Received {
    let mut received = Received::new("simulated");
    received.connected(Identity {
        name: "board 0.1.0".into(),
        teeth: 2,
        ..Identity::default()
    });
    let power: Vec<f32> = (0..96).map(|bin| if bin == 35 { 4.0 } else { 1e-4 }).collect();
    received.take(&Event::Spectrum(chunk(0, &power)));
    received.take(&Event::Spectrum(chunk(96, &[1e-4; 96])));
    let strobes = (0..12).map(|tooth| Strobe {
        band: Band::Structure,
        tooth,
        meters_per_second2: [(tooth as f32).cos(), (tooth as f32).sin(), 0.0],
    });
    received.take(&Event::Strobes(StrobeChunk {
        sequence: 5,
        strobes: strobes.collect(),
    }));
    received.take(&Event::Report(report(900, Verdict::Stable)));
    received.take(&Event::Report(report(1600, Verdict::Hopf)));
    received
}

fn picture(received: &Received, choices: &Choices, (width, height): (u16, u16)) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal
        .draw(|frame| view::draw(frame, received, choices, Palette::PLAIN, false))
        .unwrap();
    let buffer = terminal.backend().buffer().clone();
    let row = |y| (0..width).map(|x| buffer[(x, y)].symbol().to_owned()).collect();
    (0..height).map(row).collect()
}

#[test]
fn each_size_says_verdict_speed_and_keys() {
    let received = in_chatter();
    for size in [(120, 40), (80, 24), (40, 12)] {
        let text = picture(&received, &Choices::default(), size).join("\n");
        for needed in [
            "CHATTER at 17.4 Hz",
            "advice",
            "q quit",
            "▲ chatter 17.4 Hz",
            "rev/min",
            "█",
        ] {
            assert!(text.contains(needed), "{size:?}: {needed} is missing in\n{text}");
        }
    }
    let narrow = picture(&received, &Choices::default(), (40, 12)).join("\n");
    assert!(narrow.contains("1045"), "the speed is cut off in\n{narrow}");
    let text = picture(&received, &Choices::default(), (20, 5)).join("\n");
    assert!(
        text.contains("CHATTER 1045") && text.contains("min 40 x 12"),
        "{text}"
    );
}

#[test]
fn the_large_verdict_takes_an_eighth_of_the_rows() {
    for size in [(200, 80), (120, 40), (80, 24), (40, 12)] {
        let rows = picture(&in_chatter(), &Choices::default(), size);
        let large = rows[1..]
            .iter()
            .take_while(|row| !row.starts_with("CHATTER"))
            .count();
        assert!(
            large * 8 >= usize::from(size.1),
            "{size:?}: {large} rows of {}",
            size.1
        );
        assert!(
            rows[1..=large].iter().all(|row| row.contains(['█', '▀'])),
            "{size:?}"
        );
    }
}

#[test]
fn no_size_and_no_state_panics() {
    let mut gone = in_chatter();
    gone.gone("the device is gone".into());
    for received in [Received::new("/dev/ttyACM0"), in_chatter(), gone] {
        for chart in [Chart::Spectrum, Chart::Map, Chart::Lobes, Chart::History] {
            let choices = Choices {
                chart,
                ..Choices::default()
            };
            for width in (0..130).step_by(3) {
                for height in (0..50).step_by(2) {
                    picture(&received, &choices, (width, height));
                }
            }
        }
    }
}

#[test]
fn the_chatter_mark_stands_below_the_chatter_peak() {
    let choices = Choices {
        zoom: Some(0),
        ..Choices::default()
    };
    let rows = picture(&in_chatter(), &choices, (60, 20));
    let column = |row: &String, symbol: char| row.chars().position(|letter| letter == symbol);
    let marks = rows
        .iter()
        .find(|row| row.contains('▲') && !row.contains("chatter"))
        .unwrap();
    let bars = rows
        .iter()
        .rev()
        .find(|row| row.starts_with('│') && row.contains('█'))
        .unwrap();
    let (mark, peak) = (column(marks, '▲').unwrap(), column(bars, '█').unwrap());
    assert!(mark.abs_diff(peak) <= 1, "mark at {mark}, peak at {peak}");
}

#[test]
fn a_spectrum_with_a_lost_chunk_is_not_shown() {
    let mut spectrum = Spectrum::default();
    spectrum.take(&chunk(96, &[1.0; 96]));
    assert!(spectrum.power.is_empty());
    spectrum.take(&chunk(0, &[1.0; 96]));
    assert!(spectrum.power.is_empty());
    spectrum.take(&chunk(96, &[2.0; 96]));
    assert_eq!(spectrum.power.len(), 192);
    assert_eq!(spectrum.end_hz(), 96.0);
    let columns = spectrum.columns(2, 96.0);
    assert_eq!(columns, [1.0, 2.0]);
}

#[test]
fn a_lost_device_is_shown_and_its_last_report_is_not_shown_as_live() {
    let mut received = in_chatter();
    received.gone("unplugged".into());
    received.gone("no such port".into());
    let text = picture(&received, &Choices::default(), (120, 40)).join("\n");
    assert!(text.contains("CABLE PULLED, WAITING FOR simulated"), "{text}");
    assert!(!text.contains("CHATTER at 17.4 Hz, not synchronous with the teeth (Hopf)\nadvice"));
    received.connected(Identity::default());
    assert_eq!(received.connection, Connection::Up);
    let shown: Vec<&String> = received.lines.iter().rev().take(2).collect();
    assert!(
        shown[0].contains("is back") && shown[1].contains("is gone"),
        "{shown:?}"
    );
}

/// A table from 600 to 800 rev/min and 6 mm: a Hopf limit at 1.5 mm, and again stable from 3 to 4 mm.
pub(super) fn lobes(depth_mm: Option<f32>) -> LobeMap {
    let hopf = |from, to| Interval {
        from: Millimeters(from),
        to: Millimeters(to),
        kind: IntervalKind::Hopf,
        chatter: Hertz(17.4),
    };
    let column = [hopf(1.5, 3.0), hopf(4.0, 6.0)];
    let validity = Validity {
        feed_from: Millimeters(0.0),
        feed_to: Millimeters(0.3),
        start: Degrees(90.0),
        exit: Degrees(180.0),
        posture: 0,
    };
    let content = Content {
        name: "two limits",
        teeth: 2,
        limits: None,
        depth_from: Millimeters(0.0),
        depth_to: Millimeters(6.0),
        speeds: &[Rpm(600.0), Rpm(800.0)],
        layers: &[Layer {
            validity,
            columns: &[&column, &column],
        }],
    };
    let mut bytes = vec![0; encoded_length(&content) as usize];
    encode(&content, &mut bytes).unwrap();
    let point = depth_mm.map(|depth| WorkingPoint {
        axial_depth: Millimeters(depth),
        start: Degrees(90.0),
        exit: Degrees(180.0),
        feed_per_tooth: Millimeters(0.1),
        posture: 0,
    });
    LobeMap::new(bytes, point).unwrap()
}

#[test]
fn the_margin_is_the_distance_to_the_next_limit_above() {
    let at = |depth| lobes(Some(depth)).margin(700.0).to_string();
    assert!(
        at(1.0).starts_with("0.50 mm below the limit of 1.50 mm"),
        "{}",
        at(1.0)
    );
    assert!(
        at(3.5).starts_with("0.50 mm below the limit of 4.00 mm"),
        "{}",
        at(3.5)
    );
    assert!(at(2.0).starts_with("none: not stable"), "{}", at(2.0));
    assert_eq!(lobes(None).margin(700.0), Margin::NoDepth);
    let outside = lobes(Some(1.0)).margin(900.0).to_string();
    assert!(
        outside.contains("outside its range of 600 to 800 rev/min"),
        "{outside}"
    );
}

#[test]
fn the_lobe_chart_marks_the_working_point() {
    let mut received = in_chatter();
    received.take(&Event::Report(Report {
        speed: Some(Rpm(700.0)),
        ..report(2000, Verdict::Stable)
    }));
    received.lobes = Some(lobes(Some(1.0)));
    let choices = Choices {
        chart: Chart::Lobes,
        ..Choices::default()
    };
    let rows = picture(&received, &choices, (60, 24));
    let text = rows.join("\n");
    assert!(text.contains("lobes, ✚ 1.00 mm"), "{text}");
    let point = rows
        .iter()
        .position(|row| row.contains('✚') && !row.contains("lobes"))
        .unwrap();
    let lowest_limit = rows.iter().rposition(|row| row.contains("HHHH")).unwrap();
    assert!(point > lowest_limit, "{text}");
    assert!(
        text.contains("margin: 0.50 mm below the limit of 1.50 mm"),
        "{text}"
    );
    assert!(!text.contains("but it chatters"), "{text}");
    received.take(&Event::Report(Report {
        speed: Some(Rpm(700.0)),
        ..report(4000, Verdict::Hopf)
    }));
    let text = picture(&received, &choices, (120, 24)).join("\n");
    assert!(
        text.contains("1.50 mm in the table; but it chatters: table or depth is wrong"),
        "{text}"
    );
}

#[test]
fn a_text_that_does_not_fit_is_wrapped_or_says_that_it_is_cut() {
    let mut received = in_chatter();
    let choices = Choices {
        chart: Chart::History,
        ..Choices::default()
    };
    received.take(&Event::Report(report(3000, Verdict::PeriodDoubling)));
    let text = picture(&received, &choices, (40, 24)).join("\n");
    assert!(text.contains("doubling)"), "{text}");
    let narrow = picture(&received, &choices, (40, 12)).join("\n");
    assert!(narrow.contains('…'), "{narrow}");
}

#[test]
fn the_strip_keeps_the_most_serious_verdict_of_a_cell() {
    let mut received = Received::new("simulated");
    for (t_ms, verdict) in [
        (0, Verdict::Stable),
        (100, Verdict::Hopf),
        (200, Verdict::Stable),
        (700, Verdict::AirCut),
    ] {
        received.take(&Event::Report(report(t_ms, verdict)));
    }
    assert_eq!(received.strip, [Some(Verdict::Hopf), Some(Verdict::AirCut)]);
}

/// A device without cuts on a pseudo-terminal: it answers all requests.
fn device() -> SimulatedDevice {
    let setup = Setup {
        state: None,
        teeth: 2,
        pace: Pace::RealTime,
    };
    SimulatedDevice::start(setup, std::sync::mpsc::channel().1).unwrap()
}

#[test]
fn a_pulled_cable_is_shown_and_the_device_is_connected_again() {
    let first = device();
    let mut paths = vec![device_path_gone(), first.path().to_owned()];
    let second = device();
    let second_path = second.path().to_owned();
    let stop = Arc::new(AtomicBool::new(false));
    let (send, news) = sync_channel(64);
    let over = stop.clone();
    let connect = move || {
        // First the first device, then a port that is not there, from then on the second device.
        let path = paths.pop().unwrap_or_else(|| second_path.clone());
        Client::connect(Box::new(SerialLine::open(&path)?))
    };
    let thread = std::thread::spawn(move || link::listen(connect, &send, &over));
    let next = || news.recv_timeout(Duration::from_secs(10)).unwrap();
    assert!(matches!(next(), News::Up(identity) if identity.teeth == 2));
    drop(first);
    assert!(matches!(
        next(),
        News::Gone(DeviceError::Unplugged { .. } | DeviceError::Line { .. })
    ));
    assert!(matches!(next(), News::Gone(DeviceError::NoPort { .. })));
    assert!(matches!(next(), News::Up(_)));
    stop.store(true, Ordering::Relaxed);
    assert!(matches!(next(), News::Ended(0)));
    thread.join().unwrap();
}

/// Path of a pseudo-terminal that is no longer there.
fn device_path_gone() -> String {
    "/dev/no-such-port".into()
}

#[test]
fn a_first_connection_that_fails_is_not_tried_again() {
    let (send, news) = sync_channel(4);
    let began = Instant::now();
    let connect = || Client::connect(Box::new(SerialLine::open(&device_path_gone())?));
    link::listen(connect, &send, &AtomicBool::new(false));
    assert!(matches!(
        news.try_recv().unwrap(),
        News::Failed(DeviceError::NoPort { .. })
    ));
    assert!(began.elapsed() < Duration::from_secs(3));
}
