//! Windows: the parts of the motion between the changes of payload.

use super::error::BatchError;
use super::requirements::Requirements;
use crate::excitation::Excitation;
use crate::variation::Payload;

/// A part of the motion with the same payloads throughout.
#[derive(Debug, Clone)]
pub(super) struct Window<'a> {
    pub excitation: Excitation<'a>,
    /// Largest magnitude of each component.
    pub peak: [f64; 9],
    /// Index of its first sample in the motion.
    pub first: usize,
    /// The payloads on the body, and those of them that it carried before too.
    pub payloads: Vec<usize>,
    pub kept: Vec<usize>,
    /// Requirements with the weights of its samples.
    pub requirements: Requirements,
}

/// The windows of a motion.
pub(super) fn windows<'a>(
    excitation: &Excitation<'a>,
    payloads: &[Payload],
    requirements: Requirements,
) -> Result<Vec<Window<'a>>, BatchError> {
    let count = excitation.count();
    let mut bounds = vec![0, count];
    for (payload, stay) in
        payloads.iter().enumerate().flat_map(|(i, one)| one.stays.iter().map(move |s| (i, s)))
    {
        let changes_at = |k: usize| k == 0 || k == count || excitation.time(k - 1) == excitation.time(k);
        if stay.is_empty() || stay.end > count || !changes_at(stay.start) || !changes_at(stay.end) {
            return Err(BatchError::Payload { payload, stay: [stay.start, stay.end], count });
        }
        bounds.extend([stay.start, stay.end]);
    }
    bounds.sort_unstable();
    bounds.dedup();
    let mut windows: Vec<Window> = Vec::with_capacity(bounds.len() - 1);
    for part in bounds.windows(2).map(|pair| pair[0]..pair[1]) {
        let is_on = |payload: &usize| payloads[*payload].stays.iter().any(|stay| stay.contains(&part.start));
        let on: Vec<usize> = (0..payloads.len()).filter(is_on).collect();
        let before = windows.last().map_or(&[][..], |window| &window.payloads);
        let kept = on.iter().copied().filter(|payload| before.contains(payload)).collect();
        let excitation = excitation.part(part.clone());
        let requirements = requirements.part(&part, count);
        let peak = excitation.peak();
        windows.push(Window { peak, excitation, first: part.start, payloads: on, kept, requirements });
    }
    Ok(windows)
}
