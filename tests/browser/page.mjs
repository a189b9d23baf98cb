/* What a page must do in a browser; `.ci/browser` runs it. The argument: a folder with the pages. Pictures go beside them. */
import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";
import puppeteer from "puppeteer-core";

const folder = process.argv[2];
const axe = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM,
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
/* What people read, with the pages of paper it may take. */
const paper = { "loop/report.html": 10, "accept/acceptance.html": 2, "check/check.html": 4, "next/next.html": 3 };
const pages = Object.keys(paper);
let passed = 0;
const test = async (name, check) => {
  await check();
  passed += 1;
  console.log("ok " + name);
};

/* A page that notes what it asks for and complains of. */
const open = async (name, { width = 1280, scheme = "light", script = true } = {}) => {
  const page = await browser.newPage();
  page.complaints = [];
  page.on("console", (message) => { if (["error", "warn"].includes(message.type())) page.complaints.push(message.text()); });
  page.on("pageerror", (error) => page.complaints.push(error.message));
  page.on("request", (request) => {
    const own = request.url();
    if (!own.startsWith("data:") && own !== "file://" + folder + "/" + name) page.complaints.push("asks for " + own);
  });
  await page.setJavaScriptEnabled(script);
  await page.setViewport({ width, height: 900 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
  await page.goto("file://" + folder + "/" + name, { waitUntil: "load" });
  if (script) await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return page;
};
const finish = async (page) => {
  assert.deepEqual(page.complaints, []);
  await page.close();
};

/* The arm's view as it stands, pixel by pixel. */
const shot = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
  const gl = document.querySelector("#view canvas").getContext("webgl");
  const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
  gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  done([...new Uint32Array(pixels.buffer)]);
}))));
const different = (one, other) => one.reduce((count, pixel, k) => count + (pixel !== other[k]), 0);
/* Sets a control of the view, as a hand does. */
const put = (page, name, value) => page.evaluate((name, value) => {
  const control = document.querySelector("[data-view=" + name + "]");
  if (control.type === "checkbox") control.checked = value;
  else control.value = value;
  control.dispatchEvent(new Event("input", { bubbles: true }));
}, name, value);

await test("a page of 10 000 poses is small, paints at once and asks for nothing", async () => {
  const size = fs.statSync(folder + "/many/report.html").size;
  assert.ok(size < 3e6, size + " bytes");
  const times = [];
  for (let k = 0; k < 3; k++) {
    const page = await open("many/report.html");
    const paint = await page.waitForFunction(() => performance.getEntriesByName("first-contentful-paint")[0]?.startTime);
    times.push(await paint.jsonValue());
    if (k === 2) {
      assert.match(await page.$eval("figure figcaption", (caption) => caption.textContent), /of \d+ rows are drawn/);
      const brush = await page.$eval("#brush output", (output) => output.textContent);
      const [, held] = brush.match(/^about 10000 of 10000 poses; rms residual of .* held out about ([\d.]+) mm$/) ?? assert.fail(brush);
      const whole = JSON.parse(fs.readFileSync(folder + "/many/estimate.json")).held_out.rms_mm.norm;
      assert.ok(Math.abs(held / whole - 1) < 0.1, held + " mm of the poses drawn, " + whole + " mm of all");
    }
    await finish(page);
  }
  const best = Math.min(...times);
  console.log("   " + size + " bytes, first paint after " + best.toFixed(0) + " ms");
  assert.ok(best < 1000, best + " ms");
});

await test("the arm is drawn, and gives way by the slider", async () => {
  const page = await open("loop/report.html");
  /* The arms alone, stiff: what the slider moves is nothing but them. */
  for (const name of ["fitted", "held_out"]) assert.ok(await page.$eval("[data-view=" + name + "]", (box) => box.checked));
  await put(page, "vectors", "none");
  await put(page, "give", 0);
  const stiff = await shot(page);
  await put(page, "give", 2.6);
  const bent = await shot(page);
  await put(page, "arms", false);
  const none = await shot(page);
  await put(page, "give", 0);
  assert.equal(different(none, await shot(page)), 0, "without arms the slider moves nothing");
  const [arms, moved] = [different(stiff, none), different(stiff, bent)];
  const picture = stiff.length;
  assert.ok(arms > 0.01 * picture, arms + " of " + picture + " pixels show arms");
  assert.ok(moved > 0.5 * arms, moved + " pixels move, " + arms + " show arms");
  await put(page, "arms", true);
  assert.equal(different(stiff, await shot(page)), 0, "back is as before");
  await put(page, "fitted", false);
  await put(page, "held_out", false);
  assert.ok(different(stiff, await shot(page)) > 0.5 * arms, "poses that are not wanted go");
  const options = await page.$$eval("[data-view=colour] option", (all) => all.map((own) => own.textContent));
  assert.ok(options.includes("temperature [°C]"), options.join());
  await finish(page);
});

await test("a click on a residual names its line and marks the pose in the other figures", async () => {
  const page = await open("loop/report.html");
  const own = await page.$("figure#residual-order circle[data-p]");
  const row = await own.evaluate((dot) => dot.dataset.p);
  await own.scrollIntoView();
  await own.click();
  const words = await page.$eval("#chosen output", (output) => output.textContent);
  assert.match(words, /measurements\.csv:\d+ \(fitted\): residual [\d.]+ mm/);
  assert.match(words, /q2 .*°/);
  const marked = await page.$$eval("circle.ring", (rings) => new Set(rings.map((ring) => ring.closest("figure").id)).size);
  assert.ok(marked >= 3, marked + " figures");
  const line = await page.evaluate((row) => JSON.parse(document.getElementById("poses").textContent).poses.find((pose) => pose.row === Number(row)).place, row);
  assert.ok(words.startsWith(line));
  await finish(page);
});

await test("a range of q2 dims the poses outside, and back", async () => {
  const page = await open("loop/report.html");
  const away = () => page.$$eval("circle.away", (dots) => dots.length);
  assert.equal(await away(), 0);
  await page.evaluate(() => {
    const input = document.querySelectorAll("#brush [data-joint=\"1\"]")[1];
    input.value = (Number(input.min) + Number(input.max)) / 2;
    input.dispatchEvent(new Event("input", { bubbles: true }));
  });
  assert.ok((await away()) > 20);
  assert.match(await page.$eval("#brush output", (output) => output.textContent), /^\d+ of 78 poses; rms/);
  await page.click("#brush button");
  assert.equal(await away(), 0);
  await page.evaluate(() => document.querySelector("rect[data-joint]").dispatchEvent(new MouseEvent("click", { bubbles: true })));
  assert.ok((await away()) > 20);
  await finish(page);
});

await test("tables sort, and figures give their data", async () => {
  const page = await open("loop/report.html");
  const column = () => page.$$eval("table.sort tr[data-row]", (lines) => lines.map((line) => Number(line.cells[line.cells.length - 2].textContent)));
  const falling = await column();
  assert.deepEqual(falling, [...falling].sort((a, b) => b - a));
  const heads = await page.$$("table.sort:has(tr[data-row]) th button");
  await heads[heads.length - 2].click();
  assert.deepEqual(await column(), [...falling].sort((a, b) => a - b));
  const links = await page.$$eval("figure a.data", (all) => all.map((own) => [own.download, decodeURIComponent(own.href.split(",").slice(1).join(","))]));
  assert.equal(links.length, (await page.$$("figure")).length);
  for (const [name, csv] of links) {
    const lines = csv.trim().split("\n");
    assert.ok(name.endsWith(".csv") && lines.length > 1, name);
  }
  await finish(page);
});

for (const name of pages) {
  await test(name + " reads without its script", async () => {
    const page = await open(name, { script: false });
    const numbers = await page.$$eval("table", (tables) => tables.map((table) => [...table.querySelectorAll("td")].filter((cell) => cell.checkVisibility() && /\d/.test(cell.textContent)).length));
    assert.ok(numbers.length >= 2 && numbers.every((count) => count > 0), "cells with numbers: " + numbers);
    const drawings = await page.$$eval("figure svg", (all) => all.map((own) => own.getBoundingClientRect().height));
    assert.ok(drawings.every((height) => height > 50), "heights of figures: " + drawings);
    /* What is there to be used has a use: links and what folds need no script. */
    const idle = await page.$$eval("button, input, select, canvas, [onclick], [data-script]", (all) => all.filter((own) => own.checkVisibility()).map((own) => own.outerHTML.slice(0, 80)));
    assert.deepEqual(idle, []);
    await finish(page);
  });
}

for (const name of pages) {
  for (const width of [1280, 400]) {
    for (const scheme of ["light", "dark"]) {
      await test(name + " at " + width + " pixels, " + scheme, async () => {
        const page = await open(name, { width, scheme });
        const beyond = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
        assert.equal(beyond, 0, "wider than the window");
        await page.evaluate(axe);
        const found = await page.evaluate(() => window.axe.run());
        const serious = found.violations.filter((own) => ["serious", "critical"].includes(own.impact));
        assert.deepEqual(serious.map((own) => own.id + ": " + own.nodes.map((node) => node.target).slice(0, 3).join(" ")), []);
        await page.screenshot({ path: folder + "/" + name.replace(/\W/g, "-") + "-" + width + "-" + scheme + ".png", fullPage: true });
        await finish(page);
      });
    }
  }
  await test(name + " on paper", async () => {
    const page = await open(name);
    const file = folder + "/" + name.replace(/\W/g, "-") + ".pdf";
    await page.pdf({ path: file, format: "A4", preferCSSPageSize: true });
    const sheets = fs.readFileSync(file, "latin1").match(/\/Type \/Page\b(?!s)/g).length;
    console.log("   " + sheets + " pages");
    assert.ok(sheets <= paper[name], sheets + " pages");
    /* A4 less its margins, at 96 pixels an inch. */
    await page.emulateMediaType("print");
    await page.setViewport({ width: Math.floor((186 / 25.4) * 96), height: 1030 });
    const cut = await page.evaluate(() => [...document.querySelectorAll("body *")].filter((own) => own.checkVisibility() && !own.closest("svg *")).filter((own) => {
      const beyond = own.getBoundingClientRect().right > document.documentElement.clientWidth + 1;
      const hides = getComputedStyle(own).overflowX !== "visible" && own.scrollWidth > own.clientWidth + 1;
      return beyond || hides;
    }).map((own) => own.outerHTML.slice(0, 80)));
    assert.deepEqual(cut, []);
    const torn = await page.$$eval("figure, tr", (all) => all.filter((own) => own.checkVisibility() && (getComputedStyle(own).breakInside !== "avoid" || own.getBoundingClientRect().height > 1030)).map((own) => own.outerHTML.slice(0, 80)));
    assert.deepEqual(torn, []);
    const folded = await page.$$eval("details:not([open])", (all) => all.filter((own) => own.checkVisibility() || !own.nextElementSibling.checkVisibility()).length);
    assert.equal(folded, 0, "what is folded away is said in a sentence");
    await page.screenshot({ path: file.replace(/pdf$/, "paper.png"), fullPage: true });
    await finish(page);
  });
}
await browser.close();
console.log(passed + " passed, 0 failed");
