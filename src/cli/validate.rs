//! `abbe validate`: renders whose answer is known from theory, one row for each number.

use super::print::out;
use super::{Done, Outcome, device, interrupt};
use crate::error::{Error, Result, suggest};
use crate::render::Renderer;
use crate::stats::BatchStats;
use crate::validate::{self, Case, FAMILY, Verdict, all};
use serde_json::{Value, json};

const EXAMPLES: &str = "Examples:
  abbe validate                                all cases
  abbe validate --list
  abbe validate --case rainbow-1 --case slab --budget 16
  abbe validate --device llvmpipe --json > validated.json

Each row: what was measured, what it must be, how far it is off, its standard error sigma from 24 independent batches, the greatest sigma at which
agreement tells something, and the verdict. A row passes within a limit of some sigma, such that all rows together raise a false alarm once
in a thousand runs, and what its exact value leaves out (digits, geometry, single precision). The exit code is 1 if any row does not pass.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Run this case only (may be given again)
    #[arg(long, value_name = "NAME")]
    case: Vec<String>,
    /// List the cases and their rows instead
    #[arg(long)]
    list: bool,
    /// Samples of every case, in units of the least that tells something
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1000))]
    budget: u32,
    /// Part of a device's name (see 'abbe devices')
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Print one JSON object per row
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// Print a table in Markdown
    #[arg(long)]
    markdown: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let cases = chosen(&args.case)?;
    if args.list {
        cases.iter().for_each(|case| list(case, args.json));
        return Ok(Done::Completely);
    }
    interrupt::heed();
    let head = ["case", "measured", "exact", "deviation", "sigma", "largest"];
    if args.markdown {
        out("| case | measured | exact | deviation | sigma | largest sigma | |\n|---|---|---|---|---|---|---|");
    } else if !args.json {
        out(&text(head.map(String::from), "verdict"));
    }
    let (mut stats, mut all_pass) = (BatchStats::default(), true);
    for case in &cases {
        let outcomes = case.run(
            &|scene, seed, techniques, light_paths| {
                let opened = device::open_with(scene, (args.device.as_deref(), None), seed, techniques, light_paths, 0)?;
                Ok(opened.integrator as Box<dyn Renderer>)
            },
            args.budget,
            &mut stats,
        )?;
        for outcome in &outcomes {
            all_pass &= outcome.verdict == Verdict::Passed;
            print(args, outcome);
        }
        if interrupt::requested() {
            return Ok(Done::Interrupted);
        }
    }
    let dropped = validate::dropped(&stats);
    all_pass &= dropped.verdict == Verdict::Passed;
    print(args, &dropped);
    Ok(if all_pass { Done::Completely } else { Done::Differently })
}

/// The cases of these names, or all.
fn chosen(names: &[String]) -> Result<Vec<Case>> {
    let mut cases = all();
    let ids: Vec<&str> = cases.iter().map(|c| c.id).collect();
    for name in names {
        if !ids.contains(&name.as_str()) {
            return Err(Error::usage(format!("there is no case {name:?}"), suggest(name, ids.iter().copied())));
        }
    }
    cases.retain(|c| names.is_empty() || names.iter().any(|n| n == c.id));
    Ok(cases)
}

fn list(case: &Case, as_json: bool) {
    if as_json {
        let rows =
            case.rows.iter().map(|r| json!({"id": r.id, "exact": r.exact, "largest_sigma": r.largest_sigma, "floor": r.floor}));
        out(&json!({"case": case.id, "title": case.title, "rows": rows.collect::<Vec<Value>>()}).to_string());
        return;
    }
    out(&format!("{}: {}", case.id, case.title));
    case.rows.iter().for_each(|row| out(&format!("    {:<34} {}", row.id, number(row.exact))));
}

fn verdict(outcome: &validate::Outcome) -> &'static str {
    match outcome.verdict {
        Verdict::Passed => "pass",
        Verdict::Failed => "FAIL",
        Verdict::TooNoisy => "TOO NOISY",
    }
}

fn print(args: &Args, o: &validate::Outcome) {
    let cells = [
        o.id.clone(),
        number(o.measured),
        number(o.exact),
        format!("{:.1e}", o.measured - o.exact),
        format!("{:.1e}", o.sigma),
        format!("{:.1e}", o.largest_sigma),
    ];
    if args.json {
        out(&json!({
            "id": o.id,
            "measured": o.measured,
            "exact": o.exact,
            "deviation": o.measured - o.exact,
            "sigma": o.sigma,
            "limit": o.limit,
            "greatest_sigma": o.greatest_sigma,
            "largest_sigma": o.largest_sigma,
            "comparisons": o.comparisons,
            "family": FAMILY,
            "verdict": verdict(o),
        })
        .to_string());
    } else if args.markdown {
        out(&format!("| `{}` | {} | {} |", cells[0], cells[1..].join(" | "), verdict(o)));
    } else {
        out(&text(cells, verdict(o)));
    }
}

fn text([id, measured, exact, deviation, sigma, largest]: [String; 6], verdict: &str) -> String {
    format!("{id:<34} {measured:>12} {exact:>12} {deviation:>9} {sigma:>8} {largest:>8}  {verdict}")
}

/// Seven digits, as few as say it.
fn number(v: f64) -> String {
    if v != 0.0 && (v.abs() < 1e-3 || v.abs() >= 1e6) {
        return format!("{v:.5e}");
    }
    let text = format!("{v:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}
