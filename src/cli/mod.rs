//! The command line: a file for each command.
//!
//! Results go to standard output, progress and errors to standard error. Exit codes: 0 done, 1 what was
//! compared is not alike or not as it must be, 2 the request or its input is at fault, or its files cannot be written (one line says what and what to do), 3 the device failed at its work,
//! 4 more than one path in a million ended where more volumes overlap than it can keep, 130, 143 and 129 ended by INT (Ctrl-C), TERM and HUP. Before the last four what was rendered is written.

mod bands;
mod bench;
mod check;
mod checkpoint;
mod compare;
mod denoise;
mod develop;
mod device;
mod disk;
mod glass;
mod info;
mod interrupt;
mod lens;
mod load;
mod logger;
mod merge;
mod new;
mod picture;
pub mod plot;
mod preview;
mod print;
mod probe;
mod progress;
mod quantity;
mod render;
mod sequence;
mod validate;
mod values;
#[cfg(feature = "view")]
mod view;

use crate::error::{Error, Result};
use crate::memory::{self, Lack};
use clap::{Parser, Subcommand};
use print::out;
use std::process::ExitCode;

/// Exit code of a comparison that finds a difference.
const DIFFERENT: u8 = 1;
/// Exit code of a request that cannot be met.
const FAILED: u8 = 2;
/// Exit code after a device has failed at its work.
const DEVICE_FAILED: u8 = 3;

/// Exit code of a render that lost paths in too many volumes.
const CROWDED: u8 = 4;

#[derive(Parser)]
#[command(name = "abbe", version, about = "A spectral renderer for dispersive caustics", after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "Examples:
  abbe render scenes/newton.json                    newton.exr (spectra) and newton.png (picture), 64 samples per pixel
  abbe render scenes/prism.json --time 30s -o p.exr  as good as half a minute allows
  abbe render --resume p.exr                        goes on with a render that was stopped
  abbe develop newton.exr -o n.png --tone agx        another picture of what was rendered
  abbe render scenes/fog.json --time 30s --denoise   and fog.denoised.exr, without noise
  abbe new my_scene                                 a scene to start from, with comments
  abbe check my_scene.json                          what will it show, and is something wrong?
  abbe info newton.exr                              what is in a file
  abbe compare newton.exr reference.exr             how far two files are apart
  abbe probe newton.exr 320,200                     the spectrum of a pixel
  abbe devices                                      what Abbe can render on
  abbe glass N-SF11                                 its refractive indices
  abbe lens achromat                                focal length, pupils, spots, colours
  abbe validate --case prism-n-bk7                  is that deviated as theory has it?
  abbe view scenes/prism.json                       live, in the browser: turn it, change its glass, read its spectra

Exit codes:
  0    done
  1    what was compared is not alike, or not as it must be
  2    the request or its input is at fault
  3    the device failed at its work; what was rendered is written
  4    more than one path in a million was lost where more than 8 volumes overlap; what was rendered is written
  130  ended by INT (Ctrl-C), 143 by TERM, 129 by HUP; what was rendered is written

Every command has its own --help.";

#[derive(Subcommand)]
enum Command {
    /// Render a scene to a spectral EXR and a picture
    Render(render::Args),
    /// Make one picture of shares that several machines have rendered, or of renders of different seeds
    Merge(merge::Args),
    /// Make a picture of a spectral EXR
    Develop(develop::Args),
    /// Take the noise off a spectral EXR
    Denoise(denoise::Args),
    /// List the devices that Abbe can render on
    Devices(device::Args),
    /// Say what a scene, glTF or spectral EXR file contains
    Info(info::Args),
    /// Say what a scene will show and what in it is probably a mistake, without rendering it
    Check(check::Args),
    /// Write a scene to start from
    New(new::Args),
    /// Render scenes and print speed and error, one row each
    Bench(bench::Args),
    /// Say how far two spectral EXRs are apart, and whether that is too far
    Compare(compare::Args),
    /// Print the spectrum under a pixel or a region of a spectral EXR
    Probe(probe::Args),
    /// Look up the refractive indices of a glass, or list the glasses
    Glass(glass::Args),
    /// Say what a lens does: focal length, pupils, spots, colour, transmission
    Lens(lens::Args),
    /// Hold renders to answers known from theory
    Validate(validate::Args),
    /// Look at a scene live, or at spectral EXRs, in the browser
    #[cfg(feature = "view")]
    View(view::Args),
}

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    memory::at_limit(end_for_memory);
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => return usage(&e),
    };
    logger::install();
    let done = interrupt::install().and_then(|()| match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Develop(args) => develop::run(&args),
        Command::Denoise(args) => denoise::run(&args),
        Command::Devices(args) => device::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Check(args) => check::run(&args),
        Command::New(args) => new::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Probe(args) => probe::run(&args),
        Command::Glass(args) => glass::run(&args),
        Command::Lens(args) => lens::run(&args),
        Command::Validate(args) => validate::run(&args),
        #[cfg(feature = "view")]
        Command::View(args) => view::run(&args),
    });
    let unwritten = |e| Error::usage(format!("standard output cannot be written: {e}"), "make room where it goes");
    match done.and_then(|done| print::failure().map_or(Ok(done), |e| Err(unwritten(e)))) {
        Ok(Done::Completely) => ExitCode::SUCCESS,
        Ok(Done::Differently) => ExitCode::from(DIFFERENT),
        Ok(Done::Crowded) => ExitCode::from(CROWDED),
        Ok(Done::Interrupted) | Err(Error::Interrupted) => ExitCode::from(interrupt::exit_code()),
        Err(e) => {
            print::error(&e.to_string());
            let device_failed = matches!(e, Error::Fault { .. } | Error::OutOfMemory { .. });
            ExitCode::from(if device_failed { DEVICE_FAILED } else { FAILED })
        }
    }
}

/// Ends the process, which would need more memory than `--max-memory` allows, or than there is.
fn end_for_memory(lack: Lack) -> ! {
    print::error(&match lack {
        Lack::Limit(most) => format!(
            "the scene needs more memory than the {} of --max-memory; allow more, or render a smaller scene or film",
            print::bytes(most)
        ),
        Lack::System(more) => {
            format!("memory ran out: the system does not have {} more; render a smaller scene or film", print::bytes(more))
        }
    });
    std::process::exit(i32::from(FAILED))
}

/// How a command ended that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Done {
    Completely,
    /// A comparison found a difference.
    Differently,
    /// More than one path in a million was lost where too many volumes overlap.
    Crowded,
    Interrupted,
}

type Outcome = Result<Done>;

/// Help and version as clap prints them; its errors in one line.
fn usage(e: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind;
    match e.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            out(&e.render().to_string());
            ExitCode::SUCCESS
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand | ErrorKind::MissingSubcommand => {
            print::error("no command given; try 'abbe --help'");
            ExitCode::from(FAILED)
        }
        _ => {
            let text = e.render().to_string();
            let said = text
                .lines()
                .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"))
                .map(str::trim)
                .filter(|line| !line.is_empty());
            let said: Vec<&str> = said.collect();
            let said = said.join(" ").replace(" tip: ", "; ");
            print::error(&format!("{}; try --help", said.trim_start_matches("error: ")));
            ExitCode::from(FAILED)
        }
    }
}
