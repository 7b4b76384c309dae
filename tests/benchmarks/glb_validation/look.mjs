// node look.mjs CHROMIUM PICTURE.png FILE ...: the files in three.js, as a picture; times and places of joints
// as JSON by file. Exits with 1 where the page reports an error.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { basename, dirname, extname, normalize, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const [program, picture, ...files] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const modules = process.env.GLB_VALIDATION_MODULES ?? join(here, 'node_modules');
const kinds = { '.html': 'text/html', '.js': 'text/javascript', '.glb': 'model/gltf-binary' };
const server = createServer(async (request, response) => {
  const path = normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname));
  const [, first, ...rest] = path.split('/');
  const file =
    first === 'file' ? files[Number(rest[0])] : first === 'node_modules' ? join(modules, ...rest) : join(here, first);
  try {
    response.writeHead(200, { 'content-type': kinds[extname(file)] ?? 'application/octet-stream' });
    response.end(await readFile(file));
  } catch {
    response.destroy();
  }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));
const address = `http://127.0.0.1:${server.address().port}`;
const browser = await chromium.launch({
  executablePath: program,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
});
const page = await browser.newPage({ viewport: { width: 1240, height: 900 } });
const errors = [];
page.on('pageerror', (error) => errors.push(String(error)));
page.on('console', (line) => ['error', 'warning'].includes(line.type()) && errors.push(line.text()));
await page.goto(`${address}/page.html`);
await page.waitForFunction('window.ready');
const found = {};
for (const [number, file] of files.entries()) {
  try {
    found[file] = await page.evaluate(([url, name]) => window.show(url, name), [`/file/${number}`, basename(file)]);
  } catch (error) {
    errors.push(`${file}: ${error}`);
  }
}
await page.screenshot({ path: picture, fullPage: true });
await browser.close();
server.close();
console.log(JSON.stringify({ found, errors }));
process.exitCode = (Object.keys(found).length === files.length ? 0 : 1);
