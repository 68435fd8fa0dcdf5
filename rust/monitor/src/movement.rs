//! Whether the axis stands, or moves slowly or fast, by its steps on the grid.

use crate::prepared::FRACTION;

/// How the axis moves, by the counts of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Movement {
    /// What looks like travel is noise.
    Still,
    /// One way, by less than two counts in each period.
    Slow,
    /// Faster, or to and fro.
    Fast,
}

/// Where the axis is, and how it moved last.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
pub(crate) struct Movements {
    /// Position on the grid, and the lower end of the band in which movement is noise.
    position: i32,
    band: i32,
    /// Where the band went last: -1 or 1; 0 if it did not.
    direction: i32,
    /// Periods for which the axis counts as moving after it has left the band, and for which it is not slow after a turn or a large step.
    awake: u32,
    fast: u32,
}

impl Movements {
    pub(crate) const NONE: Self = Self { position: 0, band: 0, direction: 0, awake: 0, fast: 0 };

    /// One step, in sixteenths of a count. `still`: height of the band; `window`: periods in which the estimated motion depends on it.
    pub(crate) fn step(&mut self, step: i32, still: i32, window: u32) {
        self.position = self.position.wrapping_add(step);
        let above = self.position.wrapping_sub(self.band);
        let mut is_fast = step.unsigned_abs() >= 2 * FRACTION.unsigned_abs();
        if above < 0 || above > still {
            self.band = if above < 0 { self.position } else { self.position.wrapping_sub(still) };
            let before = core::mem::replace(&mut self.direction, if above < 0 { -1 } else { 1 });
            is_fast |= before == -self.direction;
            self.awake = window;
        }
        if is_fast {
            self.fast = window;
        }
    }

    /// The movement in the next period that is computed.
    pub(crate) fn next(&mut self) -> Movement {
        self.awake = self.awake.saturating_sub(1);
        self.fast = self.fast.saturating_sub(1);
        match (self.awake, self.fast) {
            (0, _) => Movement::Still,
            (_, 0) => Movement::Slow,
            _ => Movement::Fast,
        }
    }
}
