// A page in a folder: data, kernels and modules are files in a folder beside it.
async function fetchBytes(name) {
  const answer = await fetch(name);
  if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
  return new Uint8Array(await answer.arrayBuffer());
}

async function unzip(name) {
  const stream = new Blob([await fetchBytes(name)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function begin() {
  const { open } = await import("hemline/main.js");
  await open(await unzip("{{parts}}/contents.bin"), await fetchBytes("{{parts}}/kernels.wasm"));
}

begin().catch((error) => {
  const reason = location.protocol === "file:" ? "A folder is served by a web host: python -m http.server" : error.message;
  document.getElementById("loading").textContent = `This page could not be opened (${reason}).`;
});
