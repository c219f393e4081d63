for (const box of document.querySelectorAll(".rv")) new View(box);
