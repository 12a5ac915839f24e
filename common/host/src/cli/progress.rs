//! A progress bar on a terminal for what takes longer.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Shorter runs show nothing.
const DELAY: Duration = Duration::from_secs(2);
/// Parts of a run that are told apart.
const PARTS: f64 = 1000.0;

/// Shows how far a run has come; nothing on a pipe.
pub(super) struct Progress {
    begin: Instant,
    bar: Option<ProgressBar>,
    visible: bool,
}

impl Progress {
    pub(super) fn new() -> Self {
        Self { begin: Instant::now(), bar: None, visible: std::io::stderr().is_terminal() }
    }

    /// The part done, from 0 to 1.
    pub(super) fn show(&mut self, part: f64) {
        if !self.visible || self.begin.elapsed() < DELAY {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("{wide_bar} {percent} % {eta}");
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1000")]
            let bar = ProgressBar::with_draw_target(Some(PARTS as u64), ProgressDrawTarget::stderr());
            match style {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 1000")]
        bar.set_position((PARTS * part.clamp(0.0, 1.0)) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
