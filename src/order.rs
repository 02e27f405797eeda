//! Order in slices, in place and without a panic whatever comparisons say: those of `core` check and panic.

/// Sorts `items` so that each stands `before` those after it: heapsort, in place, without a panic whatever the order says.
pub(crate) fn sort<E: Copy>(items: &mut [E], before: impl Fn(&E, &E) -> bool) {
    for place in (0..items.len() / 2).rev() {
        sink(items, place, &before);
    }
    for end in (1..items.len()).rev() {
        swap(items, 0, end);
        if let Some(heap) = items.get_mut(..end) {
            sink(heap, 0, &before);
        }
    }
}

/// Lets the item at `place` sink in a heap whose top is the last of all.
pub(crate) fn sink<E: Copy>(heap: &mut [E], mut place: usize, before: &impl Fn(&E, &E) -> bool) {
    while let Some(mut child) = heap.get(2 * place + 1).map(|_| 2 * place + 1) {
        let comes_before = |a: usize, b: usize| heap.get(a).zip(heap.get(b)).is_some_and(|(a, b)| before(a, b));
        if comes_before(child, child + 1) {
            child += 1;
        }
        if !comes_before(place, child) {
            break;
        }
        swap(heap, place, child);
        place = child;
    }
}

pub(crate) fn swap<E: Copy>(items: &mut [E], a: usize, b: usize) {
    if let Some((x, y)) = items.get(a).copied().zip(items.get(b).copied()) {
        items.iter_mut().skip(a).take(1).for_each(|item| *item = y);
        items.iter_mut().skip(b).take(1).for_each(|item| *item = x);
    }
}

/// Moves the item at `from` forward to `to`; those between move back by one.
pub(crate) fn bring<E: Copy>(items: &mut [E], from: usize, to: usize) {
    (to..from).rev().for_each(|place| swap(items, place, place + 1));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sorted_and_brought_as_the_standard_library_does(items in prop::collection::vec(-20i32..20, 0..40), from in 0usize..40, to in 0usize..40) {
            let (mut ours, mut theirs) = (items.clone(), items.clone());
            sort(&mut ours, |a, b| a < b);
            theirs.sort_unstable();
            prop_assert_eq!(&ours, &theirs);
            if to <= from && from < items.len() {
                let (mut ours, mut theirs) = (items.clone(), items);
                bring(&mut ours, from, to);
                theirs[to..=from].rotate_right(1);
                prop_assert_eq!(ours, theirs);
            }
        }
    }

    #[test]
    fn an_order_that_is_none_does_no_harm() {
        let mut items = [3.0, f64::NAN, 1.0, f64::NAN, 2.0];
        sort(&mut items, |a, b| a < b);
        assert_eq!(items.iter().filter(|x| x.is_nan()).count(), 2);
        sort(&mut items, |_, _| true);
        assert_eq!(items.iter().filter(|x| !x.is_nan()).sum::<f64>(), 6.0);
    }
}
