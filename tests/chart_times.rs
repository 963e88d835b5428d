//! Computing time of stability charts on one thread. This command prints it in s: `cargo test --release -p quietcut-tests --test
//! chart_times -- --ignored --nocapture --test-threads 1`.
#![allow(clippy::expect_used)]

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use nix::sys::resource::{UsageWho, getrusage};
use num_complex::Complex64;
use quietcut_testkit::results::Campaign;
use quietcut_tests::command::{binary, cases, folder};

/// A chart whose computing time is measured.
struct Chart {
    what: &'static str,
    case: &'static str,
    arguments: &'static [&'static str],
    /// Largest allowed user time, s: some twice that of the recorded figures, so that the test fails where a method has become
    /// slow, not where a core is.
    longest_s: f64,
}

const OF_THE_LITERATURE: [&str; 4] = ["--rpm", "5000:25000:200", "--depth-mm", "0:10:100"];
const OF_THE_ROBOT: [&str; 4] = ["--rpm", "600:2400:100", "--depth-mm", "0:12:100"];
const OF_RECEPTANCES: [&str; 6] = [
    "--rpm",
    "4000:14000:100",
    "--depth-mm",
    "0:10:50",
    "--frf",
    "frf.csv",
];

fn charts() -> Vec<Chart> {
    let chart = |what, case, arguments, longest_s| Chart {
        what,
        case,
        arguments,
        longest_s,
    };
    vec![
        chart(
            "radial immersion 0.05, two directions, 200 speeds",
            "sliver.toml",
            &["--no-refine"],
            0.2,
        ),
        chart(
            "radial immersion 0.05, refined between the speeds",
            "sliver.toml",
            &[],
            0.5,
        ),
        chart(
            "radial immersion 0.5, two directions, 200 speeds",
            "half.toml",
            &["--no-refine"],
            0.6,
        ),
        chart(
            "radial immersion 0.5, refined between the speeds",
            "half.toml",
            &[],
            1.4,
        ),
        chart(
            "probability at 200 speeds and 100 depths",
            "uncertain.toml",
            &["--probability"],
            10.0,
        ),
        chart("cubic terms, 100 speeds", "cubic.toml", &["--no-refine"], 1.0),
        chart(
            "receptances at 2 500 lines, half immersion, 100 speeds",
            "half.toml",
            &OF_RECEPTANCES,
            2.0,
        ),
        chart(
            "receptances at 2 500 lines, slot, 100 speeds",
            "slot.toml",
            &OF_RECEPTANCES,
            4.0,
        ),
    ]
}

/// Writes the cases, and receptances of modes at 780 and 1 530 Hz in x and 845 Hz in y with 1 Hz between the lines.
fn prepare(folder: &Path) {
    let case = |name: &str| std::fs::read_to_string(cases().join(name)).expect("a case");
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("written");
    let half = case("insperger-2dof-ad0.5.toml");
    write("sliver.toml", &case("insperger-2dof-ad0.05.toml"));
    write("half.toml", &half);
    write("slot.toml", &half.replace("start_deg = 90.0", "start_deg = 0.0"));
    write(
        "uncertain.toml",
        &half.replace("ktc_mpa = 600.0", "ktc_mpa = 600.0\nktc_mpa_std = 60.0"),
    );
    write("cubic.toml", &case("kuka-kr90-full-cubic.toml"));
    let mut table = "frequency_hz,hxx_re [m/N],hxx_im [m/N],hyy_re [m/N],hyy_im [m/N]\n".to_owned();
    for line in 1..=2500 {
        let frequency_hz = f64::from(line);
        let mode = |natural_hz: f64, damping_ratio: f64, stiffness: f64| {
            let ratio = frequency_hz / natural_hz;
            1.0 / (stiffness * Complex64::new(1.0 - ratio * ratio, 2.0 * damping_ratio * ratio))
        };
        let (x, y) = (
            mode(780.0, 0.03, 1.2e7) + mode(1530.0, 0.02, 3e7),
            mode(845.0, 0.03, 1.5e7),
        );
        writeln!(
            table,
            "{frequency_hz},{:e},{:e},{:e},{:e}",
            x.re, x.im, y.re, y.im
        )
        .expect("text");
    }
    write("frf.csv", &table);
}

/// User time of all child processes that have ended, s.
fn children_s() -> f64 {
    let time = getrusage(UsageWho::RUSAGE_CHILDREN)
        .expect("the system counts")
        .user_time();
    time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64
}

fn user_time_s(folder: &Path, chart: &Chart) -> f64 {
    let before = children_s();
    let chart_of = match chart.case {
        "cubic.toml" => &OF_THE_ROBOT[..],
        _ if chart.arguments.contains(&"--frf") => &[],
        _ => &OF_THE_LITERATURE[..],
    };
    let status = Command::new(binary())
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .args(["lobes", chart.case, "--json"])
        .args(chart_of)
        .args(chart.arguments)
        .stdout(Stdio::null())
        .status()
        .expect("the command runs");
    assert!(status.success(), "{}", chart.what);
    children_s() - before
}

#[test]
#[ignore = "a measurement on a machine that does nothing else"]
fn computing_time_of_charts() {
    let folder = folder();
    prepare(folder.path());
    let mut figures = Vec::new();
    let mut slow = Vec::new();
    for chart in charts() {
        // The least of three: other programs only add to it.
        let seconds = (0..3)
            .map(|_| user_time_s(folder.path(), &chart))
            .fold(f64::INFINITY, f64::min);
        println!("{}: {seconds:.2} s", chart.what);
        figures.push((chart.what.to_owned(), format!("{seconds:.2} s")));
        if seconds > chart.longest_s {
            slow.push(format!(
                "{}: {seconds:.2} s, allowed {} s",
                chart.what, chart.longest_s
            ));
        }
    }
    Campaign {
        name: "chart-times",
        title: "Computing time of charts, one thread",
        command: "cargo test --release -p quietcut-tests --test chart_times -- --ignored --nocapture --test-threads 1",
        seeds: "none; user time of the command, the least of three runs",
    }
    .record(&figures);
    assert!(slow.is_empty(), "{slow:#?}");
}
