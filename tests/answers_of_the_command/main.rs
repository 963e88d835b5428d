//! Runs the command and compares its answers with the committed reference, or with the answers of another build.

mod answer;
mod comparison;
mod json;
mod question;
mod reference;
mod uncompared;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use comparison::{Rule, differences};
use json::Json;
use question::Question;

/// Number of questions that run at the same time.
const AT_ONCE: usize = 2;

/// Options of this program.
struct Options {
    command: PathBuf,
    other: Option<PathBuf>,
    tests: PathBuf,
    record: bool,
    full: bool,
    only: String,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        command: PathBuf::new(),
        other: None,
        tests: PathBuf::from(env!("CARGO_MANIFEST_DIR")),
        record: false,
        full: false,
        only: String::new(),
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
        match word.as_str() {
            "--command" => options.command = PathBuf::from(value()?),
            "--other" => options.other = Some(PathBuf::from(value()?)),
            "--only" => options.only = value()?,
            "--record" => options.record = true,
            "--full" => options.full = true,
            _ => {
                return Err(format!(
                    "unknown option {word}; known: --record --full --only PATTERN --against COMMIT"
                ));
            }
        }
    }
    Ok(options)
}

fn main() -> ExitCode {
    match options().and_then(|options| run(&options)) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(count) => {
            eprintln!("answers: {count} differences");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("answers: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the questions of the options. Returns the number of differences.
fn run(options: &Options) -> Result<usize, String> {
    let began = Instant::now();
    let data = options.tests.join("data/answers");
    let known = if options.record || options.other.is_some() {
        Vec::new()
    } else {
        reference::read(&data, options.full)?
    };
    let mut questions = if let Some(other) = &options.other {
        question::questions(other, &options.tests, options.full)?
    } else if options.record {
        question::questions(&options.command, &options.tests, options.full)?
    } else {
        known.iter().map(|(question, _)| question.clone()).collect()
    };
    questions.retain(|question| {
        let has_pattern = |text: &String| text.contains(&options.only);
        // With --record a whole reference file is written: the pattern is then the name of its group.
        let is_group = question.group == options.only;
        options.only.is_empty()
            || is_group
            || (!options.record
                && (has_pattern(&question.group) || question.commands.iter().any(has_pattern)))
    });
    if questions.is_empty() {
        return Err("no question matches".to_owned());
    }
    let answers = ask_all(&questions, |question| {
        let before = match &options.other {
            Some(other) => Some(answer::answer(other, &options.tests, question)?),
            None => known
                .iter()
                .find(|(q, _)| q == question)
                .map(|(_, answer)| answer.clone()),
        };
        let now = answer::answer(&options.command, &options.tests, question)?;
        Ok((before, now))
    })?;
    println!(
        "{} questions, {:.1} s",
        questions.len(),
        began.elapsed().as_secs_f64()
    );
    if options.record {
        let answered: Vec<_> = questions
            .into_iter()
            .zip(answers.into_iter().map(|(_, now)| now))
            .collect();
        reference::write(&data, &answered)?;
        return Ok(0);
    }
    let rule = if options.other.is_some() {
        Rule::Bits
    } else {
        Rule::Tolerance
    };
    Ok(report(&answers, rule))
}

fn report(answers: &[(Option<Json>, Json)], rule: Rule) -> usize {
    let mut count = 0;
    for (before, now) in answers {
        let (Some(Json::List(before)), Json::List(now)) = (before, now) else {
            continue;
        };
        for (before, now) in before.iter().zip(now) {
            let found = differences(before, now, rule);
            if let (false, Some(line)) = (found.is_empty(), now.get("command").and_then(Json::text)) {
                println!("quietcut {line}");
            }
            for difference in &found {
                println!(
                    "  {}: {} → {}",
                    difference.path, difference.before, difference.now
                );
            }
            count += found.len();
        }
    }
    count
}

/// Runs `ask` on all questions; the results keep the order of the questions.
fn ask_all<T: Send>(
    questions: &[Question],
    ask: impl Fn(&Question) -> Result<T, String> + Sync,
) -> Result<Vec<T>, String> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(question) = questions.get(i) else { break };
                    let began = Instant::now();
                    let result = ask(question);
                    let first = question.commands.first().map_or("", String::as_str);
                    println!(
                        "{:6.1} s  {}: {first}",
                        began.elapsed().as_secs_f64(),
                        question.group
                    );
                    if let Ok(mut results) = results.lock() {
                        results.push((i, result));
                    }
                }
            });
        }
    });
    let mut results = results.into_inner().map_err(|error| error.to_string())?;
    results.sort_by_key(|(i, _)| *i);
    results.into_iter().map(|(_, result)| result).collect()
}
