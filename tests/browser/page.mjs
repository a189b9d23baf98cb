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

/* Pixels of the arm's view that are not paper. */
const drawn = (page) => page.evaluate(() => {
  const gl = document.querySelector("#view canvas").getContext("webgl");
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let count = 0;
  for (let k = 0; k < pixels.length; k += 4) count += pixels[k] !== pixels[0] || pixels[k + 1] !== pixels[1];
  return count;
});

await test("a page of 10 000 poses is small, paints at once and asks for nothing", async () => {
  const size = fs.statSync(folder + "/many/report.html").size;
  assert.ok(size < 3e6, size + " bytes");
  const times = [];
  for (let k = 0; k < 3; k++) {
    const page = await open("many/report.html");
    const paint = await page.waitForFunction(() => performance.getEntriesByName("first-contentful-paint")[0]?.startTime);
    times.push(await paint.jsonValue());
    if (k === 2) {
      assert.match(await page.$eval("figure figcaption", (caption) => caption.textContent), /of \d+ poses are drawn/);
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
  const first = await drawn(page);
  assert.ok(first > 2000, first + " pixels");
  const before = await page.evaluate(() => document.querySelector("#view canvas").toDataURL());
  await page.evaluate(() => {
    const slider = document.querySelector("[data-view=give]");
    slider.value = 2.6;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  });
  const after = await page.evaluate(() => document.querySelector("#view canvas").toDataURL());
  assert.notEqual(before, after);
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

await test("the page reads without its script", async () => {
  const page = await open("loop/report.html", { script: false });
  const text = await page.content();
  assert.ok(text.includes("mean position error") && text.includes("<svg"));
  await finish(page);
});

for (const name of ["loop/report.html", "accept/acceptance.html"]) {
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
    const paper = folder + "/" + name.replace(/\W/g, "-") + ".pdf";
    await page.pdf({ path: paper, format: "A4" });
    assert.ok(fs.statSync(paper).size > 10000);
    await finish(page);
  });
}
await browser.close();
console.log(passed + " passed, 0 failed");
