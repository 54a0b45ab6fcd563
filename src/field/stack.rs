//! A stack whose first values need no allocation.

/// A stack: the top value, up to `FEW` values below it in place, and deeper ones on the heap.
pub(crate) struct Stack<T, const FEW: usize> {
    /// The value of an empty stack before the first push.
    top: T,
    /// `None` until a second value is pushed: most programs have one step, and values for several samples are large.
    few: Option<[T; FEW]>,
    more: Vec<T>,
    len: usize,
}

impl<T: Copy, const FEW: usize> Stack<T, FEW> {
    #[inline(always)]
    pub(crate) fn new(none: T) -> Self {
        Stack {
            top: none,
            few: None,
            more: Vec::new(),
            len: 0,
        }
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, value: T) {
        if let Some(below) = self.len.checked_sub(1) {
            let few = self.few.get_or_insert([self.top; FEW]);
            match few.get_mut(below) {
                Some(place) => *place = self.top,
                None => self.more.push(self.top),
            }
        }
        self.top = value;
        self.len += 1;
    }

    #[inline(always)]
    pub(crate) fn top(&self) -> T {
        self.top
    }

    /// Value `number` of the last `count`, counted from the deepest.
    #[inline(always)]
    pub(crate) fn last(&self, count: usize, number: usize) -> T {
        let place = self.len + number - count;
        if place + 1 == self.len {
            return self.top;
        }
        match &self.few {
            Some(few) if place < FEW => few[place],
            Some(_) => self.more[place - FEW],
            None => self.top,
        }
    }

    /// Removes the last `count` values.
    #[inline(always)]
    pub(crate) fn remove(&mut self, count: usize) {
        if count == 0 {
            return;
        }
        self.len -= count;
        if let (Some(place), Some(few)) = (self.len.checked_sub(1), &self.few) {
            self.top = match few.get(place) {
                Some(value) => *value,
                None => self.more[place - FEW],
            };
        }
        self.more.truncate(self.len.saturating_sub(1 + FEW));
    }

    /// Removes the last value, and returns it.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> T {
        let top = self.top;
        self.remove(1);
        top
    }

    /// Changes the last value.
    #[inline(always)]
    pub(crate) fn change(&mut self, change: impl FnOnce(T) -> T) {
        self.top = change(self.top);
    }

    /// Replaces two values by one; the right one of them is on top.
    #[inline(always)]
    pub(crate) fn combine(&mut self, combine: impl FnOnce(T, T) -> T) {
        let right = self.pop();
        self.top = combine(self.top, right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random operations on a stack with two values in place.
    #[test]
    fn a_stack_behaves_like_a_list() {
        let (mut stack, mut list) = (Stack::<_, 2>::new(0), vec![]);
        let mut random = 1_u32;
        for number in 0..10_000 {
            random = random.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let choice = (random >> 28) as usize;
            if list.len() < 9 && choice < 9 {
                stack.push(number);
                list.push(number);
            } else if choice < 12 {
                let count = choice.min(list.len()) / 2;
                stack.remove(count);
                list.truncate(list.len() - count);
            } else if list.len() > 1 {
                stack.combine(|left, right| left ^ (right << 1));
                let right = list.pop().expect("two");
                let left = list.pop().expect("two");
                list.push(left ^ (right << 1));
            }
            let Some(last) = list.last() else { continue };
            assert_eq!(stack.top(), *last);
            for (place, value) in list.iter().enumerate() {
                assert_eq!(stack.last(list.len(), place), *value);
            }
        }
    }
}
