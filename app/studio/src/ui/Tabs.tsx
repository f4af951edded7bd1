interface Props<T extends string> {
  label: string;
  options: readonly { value: T; text: string }[];
  value: T;
  onChange: (value: T) => void;
  controls?: string;
}

/** Tabs of a panel; arrow keys move between them. */
export function Tabs<T extends string>({ label, options, value, onChange, controls }: Props<T>) {
  const onKeyDown = (event: KeyboardEvent) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    const all = [
      ...(event.currentTarget as HTMLElement).querySelectorAll<HTMLButtonElement>("button:enabled"),
    ];
    const next =
      all[
        (all.indexOf(document.activeElement as HTMLButtonElement) + step + all.length) % all.length
      ];
    next?.focus();
    next?.click();
  };
  return (
    <div class="tabs" role="tablist" aria-label={label} onKeyDown={onKeyDown}>
      {options.map((option) => (
        <button
          type="button"
          role="tab"
          key={option.value}
          aria-selected={option.value === value}
          aria-controls={controls}
          tabIndex={option.value === value ? 0 : -1}
          onClick={() => onChange(option.value)}
        >
          {option.text}
        </button>
      ))}
    </div>
  );
}
