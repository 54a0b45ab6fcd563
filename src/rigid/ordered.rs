//! Binary search in lists that are in the order of the indices of body handles.

use crate::math::RigidBodyHandle;

/// The place of a body in a list of handles.
pub(crate) fn find(handles: &[RigidBodyHandle], handle: RigidBodyHandle) -> Option<usize> {
    find_by(handles, handle, |known| *known)
}

/// [`find`] for a body that is usually at the place `guess`, which is tried first.
pub(crate) fn find_near(
    handles: &[RigidBodyHandle],
    guess: usize,
    handle: RigidBodyHandle,
) -> Option<usize> {
    match handles.get(guess) {
        Some(known) if *known == handle => Some(guess),
        _ => find(handles, handle),
    }
}

/// [`find`] in a list of any items that have a `body`.
pub(crate) fn find_by<T>(
    list: &[T],
    handle: RigidBodyHandle,
    body: impl Fn(&T) -> RigidBodyHandle,
) -> Option<usize> {
    let index = |handle: RigidBodyHandle| handle.into_raw_parts().0;
    let found = list.binary_search_by_key(&index(handle), |known| index(body(known)));
    found.ok().filter(|place| body(&list[*place]) == handle)
}

/// The item of a body, for callers that ask in the order of the list: `at` is the place that the walk through
/// it has reached.
pub(crate) fn find_next<'a, T>(
    list: &'a [T],
    at: &mut usize,
    handle: RigidBodyHandle,
    body: impl Fn(&T) -> RigidBodyHandle,
) -> Option<&'a T> {
    let index = handle.into_raw_parts().0;
    while let Some(known) = list.get(*at) {
        let next = body(known);
        if next.into_raw_parts().0 >= index {
            return (next == handle).then_some(known);
        }
        *at += 1;
    }
    None
}
