//! Lists that are in the order of the indices of body handles, and binary search in them.

use crate::math::RigidBodyHandle;

fn index(handle: RigidBodyHandle) -> u32 {
    handle.into_raw_parts().0
}

/// Sorts a list, which is in order already in most cases.
pub(crate) fn sort_by_body<T>(list: &mut [T], body: impl Fn(&T) -> RigidBodyHandle) {
    let index = |it: &T| index(body(it));
    if !list.is_sorted_by_key(index) {
        list.sort_unstable_by_key(index);
    }
}

/// Returns true if a list is in order and has each body once.
pub(crate) fn is_in_order<T>(list: &[T], body: impl Fn(&T) -> RigidBodyHandle) -> bool {
    list.is_sorted_by(|a, b| index(body(a)) < index(body(b)))
}

/// The place of a body in a list of handles.
pub(crate) fn find(handles: &[RigidBodyHandle], handle: RigidBodyHandle) -> Option<usize> {
    find_by(handles, handle, |known| *known)
}

/// [`find`] for look-ups in the order of the list: `at` is the place that the last one has reached.
#[inline]
pub(crate) fn find_next_place(
    handles: &[RigidBodyHandle],
    at: &mut usize,
    handle: RigidBodyHandle,
) -> Option<usize> {
    find_next(handles, at, handle, |known| *known).map(|_| *at)
}

/// [`find`] in a list of items, each with its `body`.
pub(crate) fn find_by<T>(
    list: &[T],
    handle: RigidBodyHandle,
    body: impl Fn(&T) -> RigidBodyHandle,
) -> Option<usize> {
    let found = list.binary_search_by_key(&index(handle), |known| index(body(known)));
    found.ok().filter(|place| body(&list[*place]) == handle)
}

/// The item of a body, for look-ups in the order of the list: `at` is the place that the last one has reached.
pub(crate) fn find_next<'a, T>(
    list: &'a [T],
    at: &mut usize,
    handle: RigidBodyHandle,
    body: impl Fn(&T) -> RigidBodyHandle,
) -> Option<&'a T> {
    while let Some(known) = list.get(*at) {
        let next = body(known);
        if index(next) >= index(handle) {
            return (next == handle).then_some(known);
        }
        *at += 1;
    }
    None
}
