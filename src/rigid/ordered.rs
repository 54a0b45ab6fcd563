//! Lists in the order of handles.

use crate::math::RigidBodyHandle;

/// The place of a body in a list that is in the order of the indices of its handles.
pub(crate) fn find(handles: &[RigidBodyHandle], handle: RigidBodyHandle) -> Option<usize> {
    find_by(handles, handle, |known| *known)
}

/// The same of one that is mostly at the place `guess`.
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

/// The same in a list of more than handles.
pub(crate) fn find_by<T>(
    list: &[T],
    handle: RigidBodyHandle,
    body: impl Fn(&T) -> RigidBodyHandle,
) -> Option<usize> {
    let index = |handle: RigidBodyHandle| handle.into_raw_parts().0;
    let found = list.binary_search_by_key(&index(handle), |known| index(body(known)));
    found.ok().filter(|place| body(&list[*place]) == handle)
}

/// The same of one that is walked in that order: `at` is how far the walk has come.
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
