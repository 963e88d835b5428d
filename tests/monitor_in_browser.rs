//! The page of `monitor --web` in a browser: it shows the chatter verdict that the simulated device sends, soon, and all
//! its text fits, in both themes, on a phone and on a large screen.
//!
//! With `QUIETCUT_PICTURES=DIR` it also writes the pictures that it has examined.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use quietcut_tests::browser::Browser;
use quietcut_tests::command::{cases, done, folder};
use quietcut_tests::monitor_page::{Machine, Page};
use serde_json::{Value, json};

/// Notes the time at which the large word becomes each verdict for the first time, and errors of the scripts.
const WATCH: &str = "
    window.faults = [];
    addEventListener('error', fault => faults.push(fault.message));
    addEventListener('securitypolicyviolation', fault => faults.push(fault.violatedDirective));
    window.shown = {};
    const word = document.getElementById('word');
    new MutationObserver(() => shown[word.textContent] ??= (performance.timeOrigin + performance.now()) / 1000)
        .observe(word, {childList: true, characterData: true, subtree: true});
    true";

/// Texts that overlap another one, that are cut off by their box, or that leave the page.
const FAULTS: &str = r"(() => {
    const found = [], boxes = [];
    const page = document.documentElement;
    if (page.scrollWidth > innerWidth) found.push(`the page is ${page.scrollWidth} wide`);
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const node = walker.currentNode, parent = node.parentElement;
        if (!node.textContent.trim() || parent.closest('script, style, noscript, title, #history, #strip')) continue;
        const range = document.createRange();
        range.selectNodeContents(node);
        for (const box of range.getClientRects()) {
            if (box.width < 1) continue;
            const text = node.textContent.trim().slice(0, 40);
            if (box.left < -1 || box.right > innerWidth + 1) found.push(`${text} leaves the page`);
            const picture = parent.closest('svg');
            const frame = picture && picture.getBoundingClientRect();
            if (frame && (box.left < frame.left - 1 || box.right > frame.right + 1 || box.bottom > frame.bottom + 1 || box.top < frame.top - 1)) found.push(`${text} leaves its picture`);
            boxes.push({node, text, box});
        }
    }
    // Line boxes are higher than letters: a fifth of their height may be shared.
    const shared = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
        && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.2 * Math.min(a.height, b.height);
    boxes.forEach((one, index) => boxes.slice(index + 1).forEach(other => {
        if (one.node !== other.node && shared(one.box, other.box)) found.push(`${one.text} overlaps ${other.text}`);
    }));
    if (boxes.length < 30) found.push(`only ${boxes.length} texts`);
    return found;
})()";

/// Contrast of each text with what is behind it, where it is below 4.5, the least of WCAG for text.
const FAINT_TEXTS: &str = r"(() => {
    const numbers = colour => colour.match(/[\d.]+/g).map(Number);
    const light = ([r, g, b]) => [r, g, b].map(c => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
        .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
    const behind = element => {
        for (; element; element = element.parentElement) {
            const colour = numbers(getComputedStyle(element).backgroundColor);
            if (colour.length === 3 || colour[3] === 1) return colour;
        }
        return [255, 255, 255];
    };
    const found = [];
    for (const element of document.querySelectorAll('h1, h2, p, dt, dd, small, button, legend, li, #strip span, svg text')) {
        if (!element.textContent.trim() || element.closest('noscript')) continue;
        const style = getComputedStyle(element);
        const [a, b] = [light(numbers(element.closest('svg') ? style.fill : style.color)), light(behind(element))];
        const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
        if (contrast < 4.5) found.push(`${element.id || element.textContent.slice(0, 20)}: ${contrast.toFixed(2)}`);
    }
    return [...new Set(found)];
})()";

fn now_s() -> f64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap()
        .as_secs_f64()
}

fn write_picture(browser: &mut Browser, name: &str) {
    if let Some(folder) = std::env::var_os("QUIETCUT_PICTURES") {
        let file = Path::new(&folder).join(format!("{name}.png"));
        std::fs::write(file, browser.picture()).unwrap();
    }
}

#[test]
#[ignore = "browser: tests/run installs chromium"]
fn chatter_is_shown_in_a_browser() {
    let folder = folder();
    let case = cases().join("kuka-kr90-acetal.toml");
    let table = format!(
        "table {} --rpm 600:2400:10 --speeds 10 --out cell.qct",
        case.display()
    );
    done(folder.path(), &table);
    let machine = Machine::start();
    let page = Page::open(folder.path(), machine.path(), &["--web", "--table", "cell.qct"]);
    let mut browser = Browser::open(&page.url);
    browser.wait_for("document.body?.dataset.link === 'up'");
    browser.value(WATCH);
    let mut socket = page.socket();
    machine.chatter();
    let words = ["UNSURE", "IN AIR", "QUIET", "CHATTER"];
    let received_s = words.map(|word| {
        socket.head(|head| head["word"] == word);
        now_s()
    });
    browser.wait_for("shown.CHATTER > 0");
    let delays: Vec<f64> = (words.iter().zip(received_s))
        .map(|(word, received_s)| {
            let shown_s = browser.value(&format!("shown['{word}']"));
            shown_s.as_f64().unwrap() - received_s
        })
        .collect();
    println!("s from a socket to the page, of {words:?}: {delays:.4?}");
    // A busy machine delays a process: the shortest delay is that of the page.
    let shortest = delays.into_iter().fold(f64::INFINITY, f64::min);
    assert!(shortest <= 0.1, "{shortest} s");
    browser.wait_for("/^▲ chatter 17/.test(document.getElementById('chatter-label')?.textContent)");
    let is_there = "document.getElementById('sentence').textContent.startsWith('CHATTER at 17') \
         && document.getElementById('advice').textContent.includes('rev/min') \
         && document.querySelector('#history li').textContent.includes('CHATTER') \
         && document.getElementById('strip').textContent.includes('D') \
         && document.querySelectorAll('#map .dots').length === 2 \
         && document.querySelectorAll('#lobes .point').length === 1";
    browser.wait_for(is_there);
    // The picture stands still while it is examined, so that the cut does not end meanwhile.
    browser.value("document.getElementById('freeze').click()");
    for width in [360, 1600] {
        for theme in ["light", "dark"] {
            browser.show(width, theme);
            let name = format!("{width}-{theme}");
            write_picture(&mut browser, &name);
            assert_eq!(browser.value(FAULTS), json!([]), "{name}");
            assert_eq!(browser.value(FAINT_TEXTS), json!([]), "{name}");
        }
    }
    browser.value("document.getElementById('freeze').click()");
    drop(machine);
    browser.wait_for("document.getElementById('connection').textContent.includes('CABLE PULLED')");
    write_picture(&mut browser, "gone");
    drop(page);
    browser.wait_for("document.getElementById('connection').textContent.includes('no connection')");
    assert_eq!(browser.value("faults"), Value::Array(Vec::new()));
}
